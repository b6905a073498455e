"""Errors that nobody catches, in programs that are not er_il's, such as LeRobot's stock commands."""

import sys
from types import TracebackType

from er_il.support.errors import ErIlError
from er_il.support.failures import explanation


def tell_uncaught_in_one_line() -> None:
    """Let an :class:`ErIlError`, or what was raised from one, end this program with one line instead of a traceback."""
    if sys.excepthook is not _tell:
        global _before
        _before, sys.excepthook = sys.excepthook, _tell


_before = sys.excepthook


def _tell(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, ErIlError):
        cause = cause.__cause__
    if cause is None:
        _before(kind, error, at)
    else:
        print(f"error: {explanation(cause)}", file=sys.stderr)
