"""Checks of this machine: requirements of er_il, and remedies for missing ones."""

import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from er_il.support.display import has_display

PYTHON = (3, 12)  # what pyproject.toml asks for
FOLDERS = ("outputs", "datasets", "policies")  # where the commands write by default
FREE_SPACE = 1e9  # [byte]
PATIENCE = 120.0  # [s] for one probe: a first import from a cold disk is slow

BACKENDS = ("egl", "osmesa", "glfw")  # MuJoCo's ways to render on Linux, the best first
PACKAGES = "libegl1 libgl1-mesa-dri"  # Debian's, for EGL in software

_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco/>")
renderer = mujoco.Renderer(model, 8, 8)
renderer.update_scene(mujoco.MjData(model))
renderer.render()
"""
_RENDER_AS_TASKS_DO = "import sim_tasks.world" + _RENDER
_ROBOT = "import er_il; er_il.Arm.preset('panda')"
_TORCHCODEC = "import torchcodec.decoders"
_GPU = """
import torch
if torch.cuda.is_available():
    print(torch.cuda.get_device_name(0))
elif torch.backends.mps.is_available():
    print("Apple GPU")
"""


@dataclass(frozen=True)
class Check:
    """One thing that the machine has or lacks."""

    name: str
    present: bool
    needed: bool  # the main job, ``er-il demo``, cannot run without it
    found: str
    remedy: str = ""  # how to get what is missing


def examine(folder: Path) -> list[Check]:
    """Look at the machine and at the folder that the commands would write to."""
    # Each probe is a process of its own: a GL library that fails can take the process with it.
    with ThreadPoolExecutor() as pool:
        rendering = pool.submit(_rendering)
        video = pool.submit(_video)
        gpu = pool.submit(_gpu)
        return [_python(), _robot(), rendering.result(), _writable(folder), video.result(), _display(), gpu.result()]


def _python() -> Check:
    wanted = ".".join(map(str, PYTHON))
    return Check(
        "Python", sys.version_info[:2] == PYTHON, True, platform.python_version(), f"`uv python install {wanted}`"
    )


def _robot() -> Check:
    package = "example-robot-data"
    if not _succeeds(_ROBOT):
        return Check("Robot model", False, True, "not to be read", f"`uv sync`, or `pip install {package}`")
    return Check("Robot model", True, True, f"{package} {importlib.metadata.version(package)}")


def _rendering() -> Check:
    name, linux = "Rendering", sys.platform == "linux"
    setting = os.environ.get("MUJOCO_GL")
    asked = f"MUJOCO_GL={setting}" if setting else "the default backend"
    if _succeeds(_RENDER_AS_TASKS_DO):
        return Check(name, True, True, f"{asked} works")
    for backend in BACKENDS if linux else ():
        if _succeeds(_RENDER, {"MUJOCO_GL": backend}):
            return Check(name, False, True, f"{asked} fails", f"`export MUJOCO_GL={backend}`")
    return Check(
        name,
        False,
        True,
        f"{asked} fails",
        f"`apt install {PACKAGES}`" if linux else "a session with graphics",
    )


def _writable(folder: Path) -> Check:
    name = "Output folders"
    for path in (folder / each for each in FOLDERS):
        existing = next(each for each in (path, *path.parents) if each.exists())
        try:
            with tempfile.TemporaryFile(dir=existing):
                pass
        except OSError as error:
            return Check(name, False, True, f"{path}: {error.strerror}", "change to a folder that you may write to")
    free = shutil.disk_usage(folder).free
    return Check(name, free >= FREE_SPACE, True, f"writable, {free / 1e9:.0f} GB free", "free at least 1 GB of disk")


def _video() -> Check:
    name = "Video decoding"
    if _succeeds(_TORCHCODEC):
        return Check(name, True, False, "torchcodec")
    try:
        import av
        from av.codec import Codec

        Codec("libdav1d", "r")  # LeRobot's videos are AV1
    except (ImportError, ValueError) as error:
        return Check(name, False, False, f"neither torchcodec nor PyAV ({error})", "`apt install ffmpeg`")
    return Check(name, True, False, f"PyAV {av.__version__} (torchcodec would need ffmpeg)")


def _display() -> Check:
    name = "Display for Rerun"
    if has_display():
        return Check(name, True, False, os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or "yes")
    return Check(name, False, False, "none", "or use `er-il view` with --save or --serve")


def _gpu() -> Check:
    name = "GPU"
    if device := _output(_GPU):
        return Check(name, True, False, device)
    return Check(name, False, False, "none", "only training from images wants one")


def _succeeds(code: str, environment: Mapping[str, str] | None = None) -> bool:
    return _output(code, environment) is not None


def _output(code: str, environment: Mapping[str, str] | None = None) -> str | None:
    """Output of a fresh Python that runs the code; None if it fails or takes too long."""
    try:
        probe = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | (environment or {}),
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=True,
        )
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired):
        return None
    return probe.stdout.strip()
