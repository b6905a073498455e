"""The command line, ``er-il``: one module a command, each a thin layer over the noun that does the work."""

import importlib
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import NoReturn

from er_il.support.failures import REPORT, explanation

# Command -> module under er_il.cli that holds a function of the command's name. The modules import the standard
# library and tyro only; NumPy, torch, MuJoCo and the like wait inside the functions, so that help is instant.
COMMANDS: dict[str, str] = {
    "advise": "advise",
    "attach": "attach",
    "audit": "audit",
    "benchmark": "benchmark",
    "circle": "circle",
    "demo": "demo",
    "doctor": "doctor",
    "encode": "encode",
    "eval": "eval",
    "generate": "generate",
    "replay": "replay",
    "retarget": "retarget",
    "rl": "rl",
    "study": "study",
    "train": "train",
    "verify": "verify",
    "view": "view",
}


USER_MISTAKE = 2  # exit code, as for unknown options
INTERRUPTED = 130
RESUMES = "Interrupted. The same command resumes."


def main() -> None:
    """Run the command line; user mistakes print one line and exit with code 2, interruptions with code 130."""
    interruption = _Interruption()
    try:
        import tyro  # here, where Ctrl-C is answered

        tyro.extras.subcommand_cli_from_dict(
            {name: _command(name, module) for name, module in COMMANDS.items()},
            prog="er-il",
            description="Redundancy-aware action spaces for robot imitation learning.",
        )
    except BrokenPipeError:  # the reader has seen enough, as in: er-il advise panda | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        _leave(RESUMES, INTERRUPTED)
    except Exception as error:
        if interruption.came:  # a library that was being imported, or called back, has made something else of it
            _leave(RESUMES, INTERRUPTED)
        if said := explanation(error):
            _leave(f"error: {said}", USER_MISTAKE)
        error.add_note(REPORT)
        raise
    finally:
        interruption.restore()


class _Interruption:
    """Remembers Ctrl-C, which also raises a KeyboardInterrupt as ever."""

    def __init__(self) -> None:
        self.came = False
        self._before = signal.getsignal(signal.SIGINT)
        if self._before is signal.default_int_handler and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, self._remember)

    def _remember(self, number: int, frame: FrameType | None) -> None:
        self.came = True
        raise KeyboardInterrupt

    def restore(self) -> None:
        if signal.getsignal(signal.SIGINT) == self._remember:
            signal.signal(signal.SIGINT, self._before)


def _command(name: str, module: str) -> Callable[..., None]:
    return getattr(importlib.import_module(f"er_il.cli.{module}"), name.replace("-", "_"))


def _leave(message: str, code: int) -> NoReturn:
    print(message, file=sys.stderr)
    sys.exit(code)
