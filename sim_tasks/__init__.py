"""MuJoCo tasks for a redundant arm, as Gymnasium environments ``sim_tasks/<Task>-v0``."""

import os
import sys
from ctypes.util import find_library

# Read by MuJoCo when it is imported: without a display, EGL can render, but where it is missing not even
# the physics would start.
if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    if find_library("EGL"):
        os.environ.setdefault("MUJOCO_GL", "egl")

import gymnasium

from er_il.support.errors import RenderError

try:
    import mujoco  # noqa: F401
except (ImportError, AttributeError, RuntimeError) as error:  # each GL backend fails in its own way
    raise RenderError(
        f"MuJoCo does not start with MUJOCO_GL={os.environ.get('MUJOCO_GL', '')!r} ({error}). "
        "Valid: egl, osmesa, glfw; `er-il doctor` says which of them this machine has."
    ) from error

from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.lift_cup import LiftCup
from sim_tasks.tasks.push_button_elbow import PushButtonElbow
from sim_tasks.tasks.reach_cup import ReachCup
from sim_tasks.tasks.reach_remove_cup import ReachRemoveCup
from sim_tasks.tasks.remove_cup import RemoveCup
from sim_tasks.tasks.retrieve_bear import RetrieveBear

TASKS: tuple[type[ArmTask], ...] = (ReachCup, RemoveCup, ReachRemoveCup, LiftCup, PushButtonElbow, RetrieveBear)

for _task in TASKS:
    gymnasium.register(
        f"sim_tasks/{_task.__name__}-v0",
        entry_point=f"{_task.__module__}:{_task.__name__}",
        max_episode_steps=_task.max_steps,
    )
