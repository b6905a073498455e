"""Wiring: what a user says about an arm of their robot, and the layout that follows from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import yaml

from er_il.arms.arm import Arm, ArmAngleFrames
from er_il.arms.presets import PRESETS
from er_il.datasets.schema import STATE, Feature, dimension_names
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.spaces.spec import ACTION
from er_il.support.errors import ArmError, DatasetError, UnknownNameError

SUFFIX = ".pos"  # LeRobot's name for the position of a motor


@dataclass(frozen=True)
class Wiring:
    """One arm: its kinematics, and the dimensions that hold its joints. What is empty is guessed or left out."""

    arm: str  # preset, or path of a URDF
    label: str = ""
    ee_frame: str = ""
    base_frame: str = ""
    urdf_joints: tuple[str, ...] = ()
    redundant: tuple[str, ...] = ()
    angle_frames: tuple[str, ...] = ()  # shoulder, elbow, wrist
    joints: tuple[str, ...] = ()  # dimensions of the action, in the order of the arm's joints
    state_joints: tuple[str, ...] = ()  # likewise of the state
    units: str = "rad"
    signs: tuple[float, ...] = ()
    offsets: tuple[float, ...] = ()

    def build_arm(self) -> Arm:
        """Build the arm.

        Raises:
            UnknownNameError: it is neither a preset nor a file.
            ArmError: the URDF does not describe it.
        """
        preset = Arm.preset(self.arm) if self.arm in PRESETS else None
        if preset is None and not Path(self.arm).is_file():
            raise UnknownNameError("arm", self.arm, [*sorted(PRESETS), "the path of a URDF file"])
        given = (self.ee_frame, self.base_frame, self.urdf_joints, self.redundant, self.angle_frames)
        if preset is not None and not any(given):
            return preset
        if preset is None and not self.ee_frame:
            raise ArmError(f"{self.arm} is a URDF: give --ee-frame too, the link whose pose the actions command.")
        if self.angle_frames and len(self.angle_frames) != 3:
            raise ArmError("The angle frames are three links: shoulder, elbow, wrist.")
        frames = ArmAngleFrames(*self.angle_frames) if self.angle_frames else preset and preset.angle_frames
        return Arm.from_urdf(
            preset.urdf if preset else self.arm,
            name=preset.name if preset else None,
            ee_frame=self.ee_frame or (preset.ee_frame if preset else ""),
            base_frame=self.base_frame or (preset.base_frame if preset else None),
            joints=self.urdf_joints or (preset.joints if preset else None),
            redundant=self.redundant or (preset.redundant if preset and not self.urdf_joints else None),
            home=preset.home if preset and not self.urdf_joints else None,
            angle_frames=frames,
        )

    def part(self, kind: str, rotation: str, names: Sequence[str], state_names: Sequence[str]) -> Part:
        """Wire the arm to the dimensions of the joint vector and the state."""
        arm = self.build_arm()
        joints = self.joints or _joints_named_as(arm, names)
        for joint in joints:
            if joint not in names:
                raise UnknownNameError("dimension of the action", joint, names)
        for joint in self.state_joints:
            if joint not in state_names:
                raise UnknownNameError("dimension of the state", joint, state_names)
        state = self.state_joints or (joints if set(joints) <= set(state_names) else ())
        motors = Motors(joints, self.units, self.signs, self.offsets, state)
        return Part(self.label, make_arm_space(kind, arm, rotation=rotation), motors)


def wire(wirings: Sequence[Wiring], features: Mapping[str, Feature], kind: str, rotation: str) -> Layout:
    """The layout of a dataset's actions with these arms.

    Raises:
        ErIlError: names, numbers or files do not fit.
    """
    names = dimension_names(features[ACTION])
    state_names = dimension_names(features[STATE]) if STATE in features else ()
    return Layout(names, tuple(wiring.part(kind, rotation, names, state_names) for wiring in wirings))


def read_wirings(path: Path) -> list[Wiring]:
    """Read a YAML file with one entry an arm: its label, then what :class:`Wiring` holds.

        left:
          arm: panda
          joints: [left_joint_1.pos, left_joint_2.pos, ...]
          units: deg
        right:
          ...

    A URDF's path counts from the file's folder.

    Raises:
        DatasetError: the file is unreadable, or no such mapping.
        UnknownNameError: an entry has a key that is not known.
    """
    try:
        entries = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise DatasetError(f"Cannot read {path}: {str(error).splitlines()[0]}.") from error
    if not isinstance(entries, dict) or not entries or not all(isinstance(entry, dict) for entry in entries.values()):
        raise DatasetError(f"{path} needs one entry an arm, such as left: {{arm: panda, joints: [...]}}.")
    return [_wiring(str(label), entry, path.parent) for label, entry in entries.items()]


def _wiring(label: str, entry: Mapping[str, Any], folder: Path) -> Wiring:
    valid = {field.name: field.default for field in fields(Wiring) if field.name != "label"}
    for key in entry:
        if key not in valid:
            raise UnknownNameError(f"key of arm {label!r}", key, valid)
    if "arm" not in entry:
        raise DatasetError(f"The arm {label!r} needs a key arm: a preset or the path of a URDF.")
    values = {}
    for key, value in entry.items():
        if isinstance(valid[key], tuple) != isinstance(value, list):
            raise DatasetError(f"{key} of arm {label!r} is {'a list' if isinstance(valid[key], tuple) else 'a word'}.")
        values[key] = tuple(value) if isinstance(value, list) else str(value)
    wiring = Wiring(label=label, **values)
    beside = folder / wiring.arm
    return wiring if wiring.arm in PRESETS or not beside.is_file() else replace(wiring, arm=str(beside))


def _joints_named_as(arm: Arm, names: Sequence[str]) -> tuple[str, ...]:
    for suffix in (SUFFIX, ""):
        joints = tuple(joint + suffix for joint in arm.joints)
        if set(joints) <= set(names):
            return joints
    raise DatasetError(
        f"Which dimensions are the joints of {arm.name} ({', '.join(arm.joints)})? Name them, in this order, "
        f"with --joints. There are: {', '.join(names)}."
    )
