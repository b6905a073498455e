"""Errors that nobody catches, in programs that are not er_il's, such as LeRobot's stock commands."""

import sys
from types import TracebackType

from er_il.support.errors import ErIlError
from er_il.support.failures import explanation


def tell_uncaught_in_one_line() -> None:
    """Let an :class:`ErIlError` end this program with one line instead of a traceback; other errors as before."""
    if sys.excepthook is not _tell:
        global _before
        _before, sys.excepthook = sys.excepthook, _tell


_before = sys.excepthook


def _tell(kind: type[BaseException], error: BaseException, at: TracebackType | None) -> None:
    if isinstance(error, ErIlError):
        print(f"error: {explanation(error)}", file=sys.stderr)
    else:
        _before(kind, error, at)
