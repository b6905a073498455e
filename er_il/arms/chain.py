"""URDFs of arms that are known by numbers alone: a chain of revolute joints, without shapes."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class ChainJoint:
    """A joint, its link behind it; it turns about its frame's z unless ``axis`` says otherwise."""

    name: str
    link: str
    xyz: Triple  # [m] in the frame of the joint before
    rpy: Triple  # [rad]
    range: tuple[float, float] | None  # [rad]; None: it turns without end
    velocity: float  # [rad/s]
    axis: Triple = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Tool:
    """The end effector's frame, fixed to the last link."""

    link: str
    xyz: Triple = (0.0, 0.0, 0.0)  # [m]
    rpy: Triple = (0.0, 0.0, 0.0)  # [rad]


def chain_urdf(name: str, base: str, joints: Sequence[ChainJoint], tool: Tool) -> str:
    """Return the URDF of a chain from the link ``base`` to the tool."""
    robot = ET.Element("robot", name=name)
    for link in (base, *(joint.link for joint in joints), tool.link):
        ET.SubElement(robot, "link", name=link)
    parent = base
    for joint in joints:
        element = _joint(robot, joint.name, "revolute" if joint.range else "continuous", parent, joint)
        ET.SubElement(element, "axis", xyz=_text(joint.axis))
        limits = dict(zip(("lower", "upper"), map(str, joint.range or ()), strict=False))
        ET.SubElement(element, "limit", effort="0", velocity=str(joint.velocity), **limits)  # pyrefly: ignore[bad-argument-type]
        parent = joint.link
    _joint(robot, f"{tool.link}_joint", "fixed", parent, tool)
    return ET.tostring(robot, encoding="unicode")


def _joint(robot: ET.Element, name: str, kind: str, parent: str, child: ChainJoint | Tool) -> ET.Element:
    element = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(element, "origin", xyz=_text(child.xyz), rpy=_text(child.rpy))
    ET.SubElement(element, "parent", link=parent)
    ET.SubElement(element, "child", link=child.link)
    return element


def _text(values: Triple) -> str:
    return " ".join(f"{value:.12g}" for value in values)
