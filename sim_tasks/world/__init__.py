"""MuJoCo worlds: the robot, its surroundings, cameras and contacts."""

import os
import sys
from ctypes.util import find_library

from er_il.support.errors import RenderError

# MuJoCo reads MUJOCO_GL when it is imported. Without a display EGL can render; where EGL is missing, MuJoCo would
# not even start.
if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    if find_library("EGL"):
        os.environ.setdefault("MUJOCO_GL", "egl")

try:
    import mujoco  # noqa: F401
except (ImportError, AttributeError, RuntimeError) as error:  # each GL backend fails in its own way
    raise RenderError(
        f"MuJoCo does not start with MUJOCO_GL={os.environ.get('MUJOCO_GL', '')!r} ({error}). "
        "Valid: egl, osmesa, glfw; `er-il doctor` says which of them this machine has."
    ) from error
