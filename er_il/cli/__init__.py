"""The command line, ``er-il``: one module a command, each a thin layer over the noun that does the work."""

import importlib
import os
import sys
from collections.abc import Callable

from er_il.support.errors import ErIlError

# Command -> module under er_il.cli that holds a function of the command's name. The modules import the standard
# library and tyro only; NumPy, torch, MuJoCo and the like wait inside the functions, so that help is instant.
COMMANDS: dict[str, str] = {
    "advise": "advise",
    "attach": "attach",
    "benchmark": "benchmark",
    "circle": "circle",
    "demo": "demo",
    "doctor": "doctor",
    "encode": "encode",
    "eval": "eval",
    "generate": "generate",
    "replay": "replay",
    "study": "study",
    "train": "train",
    "verify": "verify",
    "view": "view",
}

USER_MISTAKE = 2  # exit code, as for unknown options
INTERRUPTED = 130


def main() -> None:
    """Run the command line; user mistakes print one line and exit with code 2."""
    try:
        import tyro  # here, where Ctrl-C is answered

        tyro.extras.subcommand_cli_from_dict(
            {name: _command(name, module) for name, module in COMMANDS.items()},
            prog="er-il",
            description="Redundancy-aware action spaces for robot imitation learning.",
        )
    except ErIlError as error:
        _leave(f"error: {error}", USER_MISTAKE)
    except (PermissionError, FileExistsError, IsADirectoryError, NotADirectoryError) as error:
        _leave(f"error: {error.strerror}: {error.filename}", USER_MISTAKE)
    except BrokenPipeError:  # the reader has seen enough, as in: er-il advise panda | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        if error.errno is None:
            raise
        _leave(f"error: {os.strerror(error.errno)}: {error.filename}", USER_MISTAKE)
    except KeyboardInterrupt:
        _leave("Interrupted. The same command resumes.", INTERRUPTED)


def _command(name: str, module: str) -> Callable[..., None]:
    return getattr(importlib.import_module(f"er_il.cli.{module}"), name.replace("-", "_"))


def _leave(message: str, code: int) -> None:
    print(message, file=sys.stderr)
    sys.exit(code)
