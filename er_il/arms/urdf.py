"""URDF files: finding, reading and simplifying them."""

import hashlib
import importlib.metadata
import os
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

import pinocchio as pin

from er_il.support.atomic_files import write_atomically
from er_il.support.errors import ArmError

PACKAGE = "package://"
LARGEST = 16 * 2**20  # [bytes] of a URDF, which names its meshes and holds none
DEEPEST = 100  # nested elements


def example_robot_data(relative: str) -> Path:
    """Path of a file inside the ``example-robot-data`` package, such as ``panda_description/urdf/panda.urdf``.

    Raises:
        ArmError: the package is not installed, or has no such file.
    """
    suffix = f"example-robot-data/robots/{relative}"
    try:
        files = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError as error:
        raise ArmError("The robot models are missing: install the package example-robot-data.") from error
    for file in files:
        if str(file).endswith(suffix):
            return Path(str(file.locate())).resolve()
    raise ArmError(f"example-robot-data has no file {relative!r}.")


def parse_urdf(path: Path) -> ET.Element:
    """Read a URDF's <robot> element.

    Raises:
        ArmError: the file is unreadable or no URDF.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise ArmError(f"{path} is larger than {LARGEST // 2**20} MiB: that is no URDF.")
        root = _read_xml(path)
    except OSError as error:
        raise ArmError(f"Cannot read the URDF {path}: {error.strerror}.") from error
    except (ET.ParseError, expat.ExpatError, ValueError, LookupError) as error:  # the latter of unknown encodings
        raise ArmError(f"{path} is not valid XML ({error}).") from error
    if root.tag != "robot" or root.find("link") is None:
        raise ArmError(f"{path} is not a URDF: it has no <robot> with links.")
    return root


def _read_xml(path: Path) -> ET.Element:
    """Read XML from others: without entities, which can grow without bounds, and no deeper than its readers recurse."""
    data, depth = path.read_bytes(), 0

    def refuse_entity(name: str, *rest: object) -> None:
        raise ArmError(f"{path} declares the XML entity {name!r}; a URDF needs none.")

    def enter(name: str, attributes: object) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise ArmError(f"{path} is not a URDF: its elements are nested deeper than {DEEPEST}.")

    def leave(name: str) -> None:
        nonlocal depth
        depth -= 1

    checker = expat.ParserCreate()
    checker.EntityDeclHandler, checker.StartElementHandler, checker.EndElementHandler = refuse_entity, enter, leave
    checker.Parse(data, True)
    return ET.fromstring(data)


def find_mesh(name: str, urdf: Path) -> Path:
    """Find a mesh by the name that a URDF gives it.

    Raises:
        ArmError: there is no such file.
    """
    if not name.startswith(PACKAGE):
        candidates = [urdf.parent / name.removeprefix("file://")]
    else:
        package, _, inside = name.removeprefix(PACKAGE).partition("/")
        # A package is a folder above the URDF, a sibling of one, or on ROS's path.
        shelves = [*urdf.resolve().parents, *map(Path, filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(":")))]
        candidates = [shelf / inside for shelf in shelves if shelf.name == package]
        candidates += [shelf / package / inside for shelf in shelves]
    for candidate in candidates:
        if candidate.is_file():
            return candidate
    raise ArmError(f"{urdf.name} names the mesh {name}, which is not to be found. Set ROS_PACKAGE_PATH to its package.")


def name_meshes_in(robot: ET.Element, packages: Path) -> None:
    """Let a robot's meshes name their files in a folder of packages: a generated URDF lies elsewhere."""
    for mesh in robot.iter("mesh"):
        mesh.set("filename", mesh.get("filename", "").replace(PACKAGE, f"{packages}/"))


def generated_urdf(text: str, name: str) -> Path:
    """Path of a file with that text, in the folder for temporary files; written on first use."""
    folder = Path(tempfile.gettempdir()) / f"er_il-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    path = folder / Path(name).name
    if not path.exists():
        write_atomically(path, lambda partial: partial.write_text(text))
    return path


def pinocchio_model(xml: str, name: str) -> pin.Model:
    """Build the model of a URDF's text.

    Raises:
        ArmError: the library finds a mistake that :mod:`er_il.arms.robot_tree` has not found.
    """
    try:
        return pin.buildModelFromXML(xml)
    except ValueError as error:
        raise ArmError(f"{name} cannot be read: {' '.join(str(error).split())}") from error
