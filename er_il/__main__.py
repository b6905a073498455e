"""The program ``er-il``, also as ``python -m er_il``: the command line, and Ctrl-C while it is still loaded."""

import sys


def run() -> None:
    """Load the command line and run it."""
    try:
        from er_il.cli import main

        main()
    except KeyboardInterrupt:
        sys.stderr.write("Interrupted. The same command resumes.\n")
        sys.exit(130)


if __name__ == "__main__":  # worker processes import this module, too
    run()
