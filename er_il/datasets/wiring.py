"""Declaration of the arms of a robot by its user, and the layout of a dataset's actions that follows from it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, ConfigDict, Field, StrictFloat, StrictInt, StrictStr

from er_il.arms.arm import Arm, ArmAngleFrames
from er_il.arms.presets import PRESETS
from er_il.datasets.schema import STATE, Feature, dimension_names
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.spaces.spec import ACTION
from er_il.support.declaration import Declaration, read_declaration
from er_il.support.errors import ArmError, DatasetError, UnknownNameError
from er_il.support.resources import data_dir


def _words(values: object) -> object:
    """Names that are numbers, as of dimensions without names, as words: YAML reads them as numbers."""
    return [str(each) if type(each) is int else each for each in values] if isinstance(values, list) else values


Names = Annotated[tuple[StrictStr, ...], BeforeValidator(_words)]
Numbers = tuple[StrictInt | StrictFloat, ...]

SUFFIX = ".pos"  # LeRobot's name for the position of a motor


class JointsNotFoundError(DatasetError):
    """No dimensions are named as an arm's joints."""

    def __init__(self, arm: Arm, label: str, names: Sequence[str]) -> None:
        self.arm, self.label = arm, label
        super().__init__(
            f"Which dimensions are the joints of {arm.name} ({', '.join(arm.joints)})? Name them, in this order, "
            f"with --joints or in a file of arms. There are: {', '.join(names)}."
        )


class Wiring(Declaration):
    """One arm: its kinematics, and the dimensions that hold its joints. Empty values are guessed or left out."""

    model_config = ConfigDict(populate_by_name=True)

    noun = "wiring"
    error = DatasetError

    arm: StrictStr  # preset, or path of a URDF
    label: StrictStr = ""
    ee_frame: StrictStr = ""
    base_frame: StrictStr = ""
    urdf_joints: Names = ()
    redundant: Names = ()
    angle_frames: Names = ()  # shoulder, elbow, wrist
    from_: Names = Field(default=(), validation_alias="from")  # columns with the joints; the action if empty
    state_from: Names = ()  # columns with the measured joints; the state if empty
    joints: Names = ()  # dimensions of the action, or of these columns, in the order of the arm's joints
    state_joints: Names = ()  # likewise of the state
    units: StrictStr = "rad"
    signs: Numbers = ()
    offsets: Numbers = ()

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
            angle_frames=frames,  # pyrefly: ignore[bad-argument-type]
        )

    def part(self, kind: str, rotation: str, names: Sequence[str], state_names: Sequence[str]) -> Part:
        """Wire the arm to the dimensions of the joint vector and the state."""
        arm = self.build_arm()
        joints = self.joints or joints_named_as(arm, names)
        if joints is None:
            raise JointsNotFoundError(arm, self.label, names)
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

    Args:
        path: The file, or the name of a shipped one, such as ``openarm_v2``.

    Raises:
        DatasetError: the file is unreadable, no such mapping, or an entry has a wrong key or value.
    """
    shipped = {file.stem: file for file in sorted(data_dir("configs").glob("arms/*.yaml"))}
    if not path.exists():
        if str(path) not in shipped:
            raise DatasetError(f"There is no file of arms {path}. Shipped: {', '.join(shipped)}.")
        path = shipped[str(path)]
    return read_declaration(path, "file of arms", DatasetError, lambda entries: _wirings(entries, path.parent))


def _wirings(entries: object, folder: Path) -> list[Wiring]:
    if not isinstance(entries, dict) or not entries or not all(isinstance(entry, dict) for entry in entries.values()):
        raise DatasetError("It needs one entry an arm, such as left: {arm: panda, joints: [...]}.")
    found = []
    for label, entry in entries.items():
        values: dict[str, Any] = {**entry, "label": str(label)}
        arm = values.get("arm")
        if isinstance(arm, str) and arm not in PRESETS and (folder / arm).is_file():
            values["arm"] = str(folder / arm)
        found.append(Wiring.from_dict(values, f"wiring of arm {label!r}"))
    return found


def joints_named_as(arm: Arm, names: Sequence[str]) -> tuple[str, ...] | None:
    """The dimensions that are named as an arm's joints, with or without :data:`SUFFIX`; None unless all are."""
    for suffix in (SUFFIX, ""):
        joints = tuple(joint + suffix for joint in arm.joints)
        if set(joints) <= set(names):
            return joints
    return None
