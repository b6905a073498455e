"""Arms that travel with their data: what a specification adds so that a URDF's arm can be rebuilt without the file."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from er_il.arms.arm import Arm, ArmAngleFrames
from er_il.arms.presets import PRESETS
from er_il.arms.urdf import generated_urdf

_DYNAMICS = ("inertial", "transmission", "gazebo", "material")


def arm_spec(arm: Arm) -> dict[str, Any]:
    """Describe what :meth:`er_il.spaces.ActionSpace.spec` leaves out of an arm; nothing for a preset."""
    if arm.name in PRESETS and _is_preset(arm, Arm.preset(arm.name)):
        return {}
    frames = None if arm.angle_frames is None else asdict(arm.angle_frames)
    return {"xml": _kinematic_text(arm.model_xml), "home": arm.home.tolist(), "angle_frames": frames}


def arm_from_spec(described: Mapping[str, Any]) -> Arm:
    """Rebuild an arm from ``spec["arm"]``, together with what :func:`arm_spec` put there.

    Raises:
        UnknownNameError: it carries no URDF, and no preset has its name.
        ArmError: its URDF is damaged.
    """
    if "xml" not in described:
        return Arm.preset(described["name"])
    frames = described["angle_frames"]
    return Arm.from_urdf(
        generated_urdf(described["xml"], described["urdf"]),
        name=described["name"],
        joints=described["joints"],
        base_frame=described["base_frame"],
        ee_frame=described["ee_frame"],
        redundant=described["redundant"],
        home=described["home"],
        angle_frames=None if frames is None else ArmAngleFrames(**frames),
    )


def _is_preset(arm: Arm, preset: Arm) -> bool:
    """True if an arm is a preset, with whatever weights."""
    return bool(arm.weights) and arm.joints == preset.joints and arm is preset.weighing(arm.weights)


def _kinematic_text(xml: str) -> str:
    root = ET.fromstring(xml)
    for parent in [root, *root.findall("link")]:
        for element in [child for child in parent if child.tag in _DYNAMICS]:
            parent.remove(element)
    for element in root.iter():
        element.text = element.tail = None  # indentation
    return ET.tostring(root, encoding="unicode")
