"""Availability of a display."""

import os
import sys


def has_display() -> bool:
    """True if a display is available."""
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
