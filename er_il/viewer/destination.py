"""Destinations that the viewer cannot reach, found before Rerun is imported."""

from ipaddress import ip_address
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


def check_address(address: str) -> None:
    """Refuse to serve where nothing can listen.

    Raises:
        ErIlError: it is no IP address.
    """
    try:
        ip_address(address)
    except ValueError as error:
        raise ErIlError(
            f"{address!r} is no IP address to listen on. Valid: 127.0.0.1 (this machine only), 0.0.0.0 (every network "
            "that this machine is in), or one of its own."
        ) from error


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
