"""``python -m er_il``: the command line."""

from er_il.cli import main

if __name__ == "__main__":  # worker processes import this module, too
    main()
