"""The action spaces: joint, task and the paper's redundancy-aware ER family, absolute or as deltas."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.rotation import Quaternion, RotationCode, make_rotation
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.base import ActionSpace, Decoded
from er_il.spaces.delta import PREFIX, DeltaBounds, DeltaSpace, make_delta_space
from er_il.spaces.era import EraSpace
from er_il.spaces.erj import ErjSpace
from er_il.spaces.joint import JointSpace
from er_il.spaces.spec import SPEC_VERSION
from er_il.spaces.task import TaskSpace
from er_il.support.errors import ArmError, SpecError, UnknownNameError

__all__ = [
    "SPACES",
    "ActionSpace",
    "Decoded",
    "DeltaBounds",
    "DeltaSpace",
    "JointSpace",
    "check_space",
    "from_spec",
    "make_action_space",
    "name_of",
    "split_name",
]


def _joint(arm: Arm, rotation: RotationCode, posture: Vector | None) -> ActionSpace:
    return JointSpace(arm)


def _task(arm: Arm, rotation: RotationCode, posture: Vector | None) -> ActionSpace:
    return TaskSpace(arm, rotation, posture)


def _erj(arm: Arm, rotation: RotationCode, posture: Vector | None) -> ActionSpace:
    _require_redundancy(arm)
    return ErjSpace(arm, rotation)


def _era(arm: Arm, rotation: RotationCode, posture: Vector | None) -> ActionSpace:
    _require_redundancy(arm)
    if arm.redundancy > 1:
        raise ArmError(f"{arm.name} has {arm.redundancy} redundant joints; one arm angle fixes only one. Use erj.")
    return EraSpace(arm, rotation, reference=float(kinematics_of(arm).arm_angle.along(arm.home[None])[0]))


def _require_redundancy(arm: Arm) -> None:
    if arm.redundancy == 0:
        raise ArmError(
            f"{arm.name} has {arm.dof} joints and so no redundancy: an end-effector pose already fixes them. "
            "Use joint or task."
        )


SPACES: dict[str, Callable[[Arm, RotationCode, Vector | None], ActionSpace]] = {
    "joint": _joint,
    "task": _task,
    "erj": _erj,
    "era": _era,
}


AT, AND = "@", "+"  # as in erj@panda_joint3, or erj@panda_joint1+panda_joint3 with two redundant joints


def make_action_space(
    name: str,
    arm: Arm,
    *,
    rotation: str = "quat",
    posture: Vector | None = None,
    bounds: DeltaBounds | None = None,
) -> ActionSpace:
    """Build an action space by name.

    Args:
        name: ``joint``, ``task``, ``erj`` or ``era``; with ``delta_`` in front, changes of its commands.
            ``erj@<joint>`` commands another than the arm's default joint; several are joined by ``+``.
        arm: The arm it commands.
        rotation: ``quat`` or ``rot6d``; the quaternion's hemisphere is that of the arm's home pose.
            Deltas always use a rotation vector.
        posture: (n,) [rad] null-space posture for ``task``; without it IK stays near the seed.
        bounds: Largest changes of a delta space.

    Raises:
        UnknownNameError: unknown name or rotation.
        ArmError: an ER space for an arm without redundancy, ERA without the arm's angle frames, or joints that
            the arm does not have.
    """
    kind, joints = split_name(name)
    arm = arm.commanding(joints) if joints else arm
    code = make_rotation(rotation, kinematics_of(arm).fk(arm.home)[:3, :3])
    space = _absolute(kind)(arm, code, posture)
    return make_delta_space(space, bounds) if kind.startswith(PREFIX) else space


def split_name(name: str) -> tuple[str, tuple[str, ...]]:
    """Split a space's name into its kind and the joints that it says ERJ commands, () if it says nothing.

    Raises:
        UnknownNameError: no such kind, or joints for a kind that commands none.
    """
    kind, at, joints = name.partition(AT)
    _absolute(kind)
    if at and (kind.removeprefix(PREFIX) != ErjSpace.kind or not joints):
        raise UnknownNameError("action space", name, [*SPACES, f"erj{AT}JOINT"])
    return kind, tuple(joints.split(AND)) if at else ()


def check_space(name: str) -> None:
    """Raise an :class:`UnknownNameError` unless a name is that of an absolute space."""
    if split_name(name)[0] not in SPACES:
        raise UnknownNameError("action space", name, SPACES)


def name_of(space: ActionSpace, arm: Arm) -> str:
    """Name a space as :func:`make_action_space` would make it for ``arm``."""
    commands_others = space.kind.removeprefix(PREFIX) == ErjSpace.kind and space.arm.redundant != arm.redundant
    return space.kind + (AT + AND.join(space.arm.redundant) if commands_others else "")


def _absolute(kind: str) -> Callable[[Arm, RotationCode, Vector | None], ActionSpace]:
    absolute = kind.removeprefix(PREFIX)
    if absolute not in SPACES:
        raise UnknownNameError("action space", kind, [*SPACES, *(PREFIX + name for name in SPACES)])
    return SPACES[absolute]


def from_spec(spec: Mapping[str, Any], arm: Arm | None = None, *, posture: Vector | None = None) -> ActionSpace:
    """Rebuild the space that :meth:`ActionSpace.spec` described.

    Args:
        spec: The specification, as read from a dataset's ``features["action"]["info"]["er_il"]``.
        arm: The arm, for arms that are no preset.
        posture: See :func:`make_action_space`.

    Raises:
        SpecError: the specification is of another version, incomplete, or of another arm.
    """
    if spec.get("version") != SPEC_VERSION:
        raise SpecError(f"Action spec has version {spec.get('version')!r}; this er_il reads {SPEC_VERSION}.")
    try:
        described, kind = spec["arm"], spec["space"]
        arm = arm if arm is not None else Arm.preset(described["name"])
        with suppress(ArmError):  # an arm without those joints is told below what differs
            arm = arm.commanding(described["redundant"])
        rotation: RotationCode = make_rotation(
            spec.get("rotation", Quaternion.kind), kinematics_of(arm).fk(arm.home)[:3, :3]
        )
        if "hemisphere" in spec:
            rotation = Quaternion(tuple(spec["hemisphere"]))
        space = _absolute(kind)(arm, rotation, posture)
        if isinstance(space, EraSpace):
            space = replace(space, reference=float(spec["arm_angle"]["reference"]))
        if kind.startswith(PREFIX):
            space = make_delta_space(space, DeltaBounds(**spec["bounds"]))
        expected = {key: described[key] for key in ("joints", "base_frame", "ee_frame", "redundant", "fingerprint")}
    except KeyError as error:
        raise SpecError(f"Action spec has no {error}.") from error
    actual = space.spec()["arm"]
    if (angle := space.spec().get("arm_angle")) != spec.get("arm_angle"):
        raise SpecError(
            f"The action spec measures the arm angle by {spec.get('arm_angle')}, but {arm.name!r} by {angle}."
        )
    for key, value in expected.items():
        if actual[key] != value:
            raise SpecError(f"The action spec is for {key} {value}, but the arm {arm.name!r} has {actual[key]}.")
    return space
