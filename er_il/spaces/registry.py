"""Action spaces by name, and from specifications."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from er_il.arms.arm import Arm, Vector, Weights
from er_il.kinematics.arm_angle import STEREO, UP, ArmAngle
from er_il.kinematics.linear_coordinates import SPEC_KEY, LinearCoordinates
from er_il.kinematics.redundancy import JointAngle, Redundancy
from er_il.kinematics.reference_direction import ReferenceDirection
from er_il.kinematics.rotation import Quaternion, RotationCode, make_rotation
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.base import ArmSpace
from er_il.spaces.carried import CARRIED, CarriedDeltaSpace
from er_il.spaces.chunk import RELATIVE, commands_of
from er_il.spaces.delta import PREFIX, DeltaBounds, DeltaSpace
from er_il.spaces.joint import JOINT, JointSpace
from er_il.spaces.margin import home_weights
from er_il.spaces.pose import TASK, PoseSpace
from er_il.spaces.spec import SPEC_VERSION
from er_il.spaces.spec_types import check_types
from er_il.support.errors import ArmError, SpecError, UnknownNameError


def _joint_angle(arm: Arm) -> Redundancy:
    return JointAngle(arm, arm.redundant)


def _arm_angle(direction: ReferenceDirection, arm: Arm) -> Redundancy:
    if arm.redundancy > 1:
        raise ArmError(f"{arm.name} has {arm.redundancy} redundant joints; one arm angle fixes only one. Use erj.")
    return ArmAngle.from_home(arm, direction)


def _linear_coordinates(arm: Arm) -> Redundancy:
    return LinearCoordinates(arm, arm.weights or home_weights(arm))


ERJ, ERA, ERA_STEREO, ERX = "erj", "era", "era@stereo", "erx"
REDUNDANCIES: dict[str, Callable[[Arm], Redundancy]] = {  # of the ER spaces
    ERJ: _joint_angle,
    ERA: partial(_arm_angle, UP),
    ERA_STEREO: partial(_arm_angle, STEREO),
    ERX: _linear_coordinates,
}
CARRIERS = (ERJ, ERX)  # whose changes can carry the pose's target along
SPACES = (JOINT, TASK, *REDUNDANCIES)
DELTAS: dict[str, type[DeltaSpace]] = {PREFIX: DeltaSpace, CARRIED: CarriedDeltaSpace}  # by the prefix of the name

AT, AND = "@", "+"  # as in erj@panda_joint3, or erj@panda_joint1+panda_joint3 with two redundant joints
THEN = ":"  # between the weights of a row, as in erx@0.8:-0.6:0:0:0:0:0
PLAIN = tuple(space for space in SPACES if AT not in space)  # no variants of others
CHUNK_RELATIVE = tuple(RELATIVE + space for space in SPACES)


def make_arm_space(
    name: str,
    arm: Arm,
    *,
    rotation: str = Quaternion.kind,
    posture: Vector | None = None,
    bounds: DeltaBounds | None = None,
) -> ArmSpace:
    """Build the action space of an arm, without a gripper, by name.

    Args:
        name: ``joint``, ``task``, ``erj``, ``era`` or ``erx``; with ``rel_`` in front, the same commands, which
            policies see relative to the state (:mod:`er_il.spaces.relative`). With ``delta_``, changes of its commands,
            and with ``carried_`` such that the pose's target moves along with ERJ's joint or ERX's coordinates
            (:mod:`er_il.spaces.carried`). ``erj@<joint>`` commands another than the arm's default joint; several are
            joined by ``+``. ``era@stereo`` counts the arm angle from the stereographic reference. ``erx@<weights>`` has
            other weights than the arm's (:func:`erx_name`).
        arm: The arm it commands.
        rotation: ``quat``, ``rot6d`` or ``rot6d_rows``; the quaternion's hemisphere is that of the arm's home pose.
            Deltas always use a rotation vector.
        posture: (n,) [rad] null-space posture for ``task``; without it IK stays near the seed.
        bounds: Largest changes of a delta space; by default what the arm can do in a period of 20 Hz.

    Raises:
        UnknownNameError: unknown name or rotation.
        ArmError: an ER space for an arm without redundancy, ERA without the arm's angle frames, or joints or weights
            that do not suit the arm.
    """
    kind, choice = split_name(name)
    if choice:
        arm = arm.weighing(_weights(choice)) if kind.endswith(ERX) else arm.commanding(choice)
    code = make_rotation(rotation, kinematics_of(arm).fk(arm.home)[:3, :3])
    prefix, absolute = _split_kind(kind)
    space = _absolute(absolute, arm, code, posture)
    return DELTAS[prefix](arm, space, bounds or DeltaBounds.of_arm(arm)) if prefix in DELTAS else space


def split_name(name: str) -> tuple[str, tuple[str, ...]]:
    """Split a space's name into its kind and what it says beyond: ERJ's joints, or ERX's rows; () if it says nothing.

    Raises:
        UnknownNameError: no such kind, or joints or weights for a kind that has none.
    """
    of_reference = _split_kind(name)[1] == ERA_STEREO
    kind, at, said = (name, "", "") if of_reference else name.partition(AT)
    prefix, absolute = _split_kind(kind)
    if absolute not in SPACES or (prefix == CARRIED and absolute not in CARRIERS):
        deltas = [*(PREFIX + space for space in SPACES), *(CARRIED + space for space in CARRIERS)]
        raise UnknownNameError("action space", kind, [*SPACES, *CHUNK_RELATIVE, *deltas])
    if not at:
        return kind, ()
    choice = tuple(said.split(AND))
    if not (all(choice) and (absolute == ERJ or (absolute == ERX and _weights(choice)))):
        raise UnknownNameError("action space", name, [*SPACES, f"{ERJ}{AT}JOINT", f"{ERX}{AT}NUMBER{THEN}NUMBER..."])
    return kind, choice


def erx_name(weights: Weights) -> str:
    """Name of ERX with weights W (m, n): ``erx@0.8:-0.6:0.0:...``, rows joined by ``+``."""
    return ERX + AT + weights_text(weights)


def weights_text(weights: Sequence[Sequence[float]]) -> str:
    """Weights as a name says them."""
    return AND.join(THEN.join(map(repr, map(float, row))) for row in weights)


def _weights(rows: Sequence[str]) -> Weights:
    """The weights that a name says; () if they are no numbers."""
    try:
        return tuple(tuple(map(float, row.split(THEN))) for row in rows)
    except ValueError:
        return ()


def _split_kind(kind: str) -> tuple[str, str]:
    """Split a kind into its prefix, "" for an absolute space, and the absolute space's kind."""
    prefix = next((prefix for prefix in (RELATIVE, *DELTAS) if kind.startswith(prefix)), "")
    return prefix, kind.removeprefix(prefix)


def check_space(name: str) -> None:
    """Raise an :class:`UnknownNameError` unless a name is that of an absolute or chunk-relative space."""
    if commands_of(split_name(name)[0]) not in SPACES:
        raise UnknownNameError("action space", name, [*SPACES, *CHUNK_RELATIVE])


def name_of(space: ArmSpace, arm: Arm) -> str:
    """Name a space as :func:`make_arm_space` would make it for ``arm``."""
    absolute = _split_kind(space.kind)[1]
    if absolute == ERJ and space.arm.redundant != arm.redundant:
        return space.kind + AT + AND.join(space.arm.redundant)
    if absolute == ERX and space.arm.weights != arm.weights:
        return space.kind + AT + weights_text(space.arm.weights)
    return space.kind


def arm_space_from_spec(spec: Mapping[str, Any], arm: Arm | None = None, *, posture: Vector | None = None) -> ArmSpace:
    """Rebuild the space that :meth:`er_il.spaces.base.ArmSpace.spec` described.

    Args:
        spec: The specification, as read from a dataset's ``features["action"]["info"]["er_il"]``.
        arm: The arm, for arms that are no preset.
        posture: See :func:`make_arm_space`.

    Raises:
        SpecError: the specification is of another version, incomplete, or of another arm.
    """
    if spec.get("version") != SPEC_VERSION:
        raise SpecError(f"Action spec has version {spec.get('version')!r}; this er_il reads {SPEC_VERSION}.")
    check_types(spec)
    try:
        described, kind = spec["arm"], spec["space"]
        arm = arm if arm is not None else Arm.preset(described["name"])
        with suppress(ArmError):  # an arm without those joints is told below what differs
            arm = arm.commanding(described["redundant"])
            if SPEC_KEY in spec:
                arm = arm.weighing(spec[SPEC_KEY]["weights"])
        rotation: RotationCode = make_rotation(
            spec.get("rotation", Quaternion.kind), kinematics_of(arm).fk(arm.home)[:3, :3]
        )
        if "hemisphere" in spec:
            rotation = Quaternion(tuple(spec["hemisphere"]))
        prefix, absolute = _split_kind(split_name(kind)[0])
        space = _absolute(absolute, arm, rotation, posture, spec)
        if prefix in DELTAS:
            space = DELTAS[prefix](arm, space, DeltaBounds(**spec["bounds"]))
        expected = {key: described[key] for key in ("joints", "base_frame", "ee_frame", "redundant", "fingerprint")}
    except KeyError as error:
        raise SpecError(f"Action spec has no {error}.") from error
    actual = space.spec()["arm"]
    for key, value in expected.items():
        if actual[key] != value:
            raise SpecError(f"The action spec is for {key} {value}, but the arm {arm.name!r} has {actual[key]}.")
    return space


def _absolute(
    kind: str, arm: Arm, rotation: RotationCode, posture: Vector | None, spec: Mapping[str, Any] | None = None
) -> ArmSpace:
    """An absolute space, with the conventions of a specification if one is given."""
    if kind == JOINT:
        return JointSpace(arm)
    if kind == TASK:
        return PoseSpace(arm, rotation, posture=posture)
    if arm.redundancy == 0:
        raise ArmError(
            f"{arm.name} has {arm.dof} joints and so no redundancy: an end-effector pose already fixes them. "
            "Use joint or task."
        )
    redundancy = REDUNDANCIES[kind](arm)
    return PoseSpace(arm, rotation, kind, redundancy if spec is None else redundancy.restored(spec))
