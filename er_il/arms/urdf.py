"""URDF files: finding, reading and simplifying them."""

import hashlib
import importlib.metadata
import math
import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import pinocchio as pin  # pyright: ignore[reportMissingImports]

from er_il.support.atomic_files import write_atomically
from er_il.support.errors import ArmError

PACKAGE = "package://"
TURN = 2.0 * math.pi  # [rad] a continuous joint gets limits of one turn to either side


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
        root = ET.parse(path).getroot()
    except OSError as error:
        raise ArmError(f"Cannot read the URDF {path}: {error.strerror}.") from error
    except ET.ParseError as error:
        raise ArmError(f"{path} is not valid XML ({error}).") from error
    if root.tag != "robot" or root.find("link") is None:
        raise ArmError(f"{path} is not a URDF: it has no <robot> with links.")
    return root


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


def generated_urdf(text: str, name: str) -> Path:
    """Path of a file with that text, in the folder for temporary files; written on first use."""
    folder = Path(tempfile.gettempdir()) / f"er_il-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    path = folder / Path(name).name
    if not path.exists():
        write_atomically(path, lambda partial: partial.write_text(text))
    return path


def kinematic_xml(path: Path, movable: Sequence[str] | None = None) -> str:
    """Return what kinematics needs of a URDF, as XML.

    Meshes are left out; joints outside ``movable`` become fixed; a continuous joint becomes a
    revolute one with limits of one turn to either side, since joint commands need a range.
    """
    root = parse_urdf(path)
    for link in root.findall("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
    for joint in root.findall("joint"):
        if movable is not None and joint.get("name") not in movable:
            joint.set("type", "fixed")
        elif joint.get("type") == "continuous":
            joint.set("type", "revolute")
            limit = joint.find("limit")
            limit = ET.SubElement(joint, "limit") if limit is None else limit
            limit.attrib.update(lower=str(-TURN), upper=str(TURN))
            limit.attrib.setdefault("effort", "0")
            limit.attrib.setdefault("velocity", "0")
    return ET.tostring(root, encoding="unicode")


def only_tip(xml: str, name: str) -> str:
    """Find the link at the end of a URDF's text that has one branch only.

    Raises:
        ArmError: it has several.
    """
    robot = ET.fromstring(xml)
    parents = {parent.get("link") for parent in robot.iterfind("joint/parent")}
    tips = [link for element in robot.findall("link") if (link := element.get("name", "")) not in parents]
    if len(tips) != 1:
        raise ArmError(f"{name} ends in several links, so name the end-effector frame, such as {', '.join(tips)}.")
    return tips[0]


def pinocchio_model(xml: str, name: str) -> pin.Model:
    """Build the model of a URDF's text.

    Raises:
        ArmError: links and joints form no single tree, or a joint lacks what its type needs.
    """
    try:
        return pin.buildModelFromXML(xml)
    except ValueError as error:
        raise ArmError(
            f"{name} describes no single tree of links, or a joint lacks its parent, child or limits."
        ) from error
