"""Destinations that the viewer cannot reach, found before Rerun is imported."""

from pathlib import Path

from er_il.support.display import has_display
from er_il.support.errors import ErIlError

SUFFIX = ".rrd"  # by which Rerun knows its files


def check_file(path: Path) -> None:
    """Refuse a file that Rerun would not know.

    Raises:
        ErIlError: the path does not end in ``.rrd``.
    """
    if path.suffix != SUFFIX:
        raise ErIlError(f"Rerun knows its files by {SUFFIX}; {path} ends in {path.suffix or 'nothing'}.")


def require_display() -> None:
    """Refuse to go on without a screen.

    Raises:
        ErIlError: there is none.
    """
    if not has_display():
        raise ErIlError(
            "There is no display for the viewer. Use --save FILE.rrd and open the file with `rerun` elsewhere, "
            "or --serve and look at it in a browser."
        )
