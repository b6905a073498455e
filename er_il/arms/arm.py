"""The arm: which joints of which URDF, between which frames, within which limits."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from er_il.arms.presets import PRESETS
from er_il.arms.robot_tree import RobotTree
from er_il.arms.urdf import parse_urdf, pinocchio_model
from er_il.support.errors import ArmError, UnknownNameError

Vector = NDArray[np.float64]
Weights = tuple[tuple[float, ...], ...]  # a matrix by its rows

UNIT = 1e-3  # by which products of ERX's rows may miss those of an orthonormal basis: four decimals are enough
POSE_DOF = 6  # an end-effector pose fixes six degrees of freedom; what an arm has beyond is redundant


@dataclass(frozen=True)
class ArmAngleFrames:
    """Links whose origins are the shoulder S, elbow E and wrist W of the arm angle (paper IV-B)."""

    shoulder: str
    elbow: str
    wrist: str


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm inside a URDF.

    Joints of the URDF that are not listed in ``joints`` stay at zero. Arrays are read-only.
    """

    name: str
    urdf: Path
    joints: tuple[str, ...]
    base_frame: str
    ee_frame: str
    lower: Vector  # (n,) [rad]
    upper: Vector  # (n,) [rad]
    velocity: Vector  # (n,) [rad/s]
    redundant: tuple[str, ...] = ()  # the n-6 joints that ERJ commands
    weights: Weights = ()  # W (n-6, n) of ERX's coordinates W q, rows orthonormal; fitted around home if empty
    home: Vector = field(default_factory=lambda: np.zeros(0))  # (n,) [rad] a comfortable posture
    angle_frames: ArmAngleFrames | None = None

    @classmethod
    def preset(cls, name: str) -> "Arm":
        """Return a known arm.

        Raises:
            UnknownNameError: no preset has that name.
        """
        return _preset(name)

    @classmethod
    def from_urdf(
        cls,
        urdf: str | Path,
        *,
        ee_frame: str | None = None,
        joints: Sequence[str] | None = None,
        base_frame: str | None = None,
        redundant: Sequence[str] | None = None,
        home: ArrayLike | None = None,
        angle_frames: ArmAngleFrames | None = None,
        name: str | None = None,
    ) -> "Arm":
        """Read an arm from a URDF file.

        Continuous joints get limits of one turn to either side (see :mod:`er_il.arms.robot_tree`).

        Args:
            urdf: Path of the file. Meshes are not read.
            ee_frame: Link whose pose the action commands; if omitted, the one at the end of the only branch.
            joints: Arm joints in the order of the robot's vectors; every movable joint between
                the base and the end effector if omitted.
            base_frame: Link in which poses are expressed; the URDF's root if omitted.
            redundant: The n-6 joints that ERJ commands; the first n-6 if omitted (paper IV-C:
                the base joint on a 7-DoF arm).
            home: (n,) [rad] comfortable posture; the middle of the range if omitted.
            angle_frames: Shoulder, elbow and wrist links, needed by ERA only; if omitted, the links that the second,
                the fourth and the sixth of seven joints move, where such an arm bends.
            name: Name of the arm; the URDF's robot name if omitted.

        Raises:
            ArmError: the file is unreadable, or joints, frames and limits do not fit together.
        """
        path = Path(urdf)
        tree = RobotTree.of_element(parse_urdf(path), path.name)
        base = base_frame if base_frame is not None else tree.root
        ee = ee_frame if ee_frame is not None else _only_tip(tree)
        for role, frame in [("base frame", base), ("end-effector frame", ee)]:
            if frame not in tree.links:
                raise ArmError(f"{path.name} has no {role} {frame!r}. Its links: {', '.join(tree.links)}.")
        chain = tuple(joint.name for joint in tree.chain(base, ee))
        if not chain:
            raise ArmError(f"No movable joint lies between {base!r} and {ee!r} in {path.name}.")
        chosen = tuple(joints) if joints is not None else chain
        if not chosen:
            raise ArmError(f"No joint of {path.name} is chosen. Movable joints: {', '.join(chain)}.")
        if len(set(chosen)) != len(chosen):
            raise ArmError(f"A joint is named twice in {', '.join(chosen)}.")
        if strangers := [joint for joint in chosen if joint not in chain]:
            raise ArmError(
                f"{', '.join(strangers)}: not between {base!r} and {ee!r} in {path.name}. "
                f"Movable joints there: {', '.join(chain)}."
            )
        if followers := [joint.name for joint in tree.chain(base, ee) if joint.element.find("mimic") is not None]:
            raise ArmError(
                f"{path.name}: {', '.join(followers)} mimic other joints on the way to {ee!r}; er_il commands each "
                "joint of an arm by itself."
            )
        model = pinocchio_model(tree.arm_xml(chosen), path.name)
        index = [model.joints[model.getJointId(joint)].idx_q for joint in chosen]
        lower, upper = model.lowerPositionLimit[index], model.upperPositionLimit[index]
        velocity = model.velocityLimit[index]
        spare = max(0, len(chosen) - POSE_DOF)
        arm = cls(
            name=name or tree.name,
            urdf=path.resolve(),
            joints=chosen,
            base_frame=base,
            ee_frame=ee,
            lower=_frozen(lower),
            upper=_frozen(upper),
            velocity=_frozen(velocity),
            redundant=tuple(redundant) if redundant is not None else chosen[:spare],
            home=_frozen((lower + upper) / 2 if home is None else home),
            angle_frames=angle_frames or _angle_frames(tree, [joint for joint in chain if joint in chosen]),
        )
        arm._check(tree.links)
        return arm

    def within_limits(self, q: Vector) -> Vector:
        """Joint angles q (..., n) [rad] clipped to the limits."""
        return np.minimum(np.maximum(q, self.lower), self.upper)  # numpy.clip takes four times as long for one vector

    def _check_redundant(self) -> None:
        if strangers := [joint for joint in self.redundant if joint not in self.joints]:
            raise ArmError(f"Redundant joints {', '.join(strangers)} are not among {', '.join(self.joints)}.")
        if len(self.redundant) != self.redundancy:
            raise ArmError(
                f"{self.name} has {self.dof} joints, so ERJ commands {self.redundancy} of them, "
                f"not {len(self.redundant)} ({', '.join(self.redundant)})."
            )

    def _check(self, links: Sequence[str]) -> None:
        self._check_redundant()
        if self.home.shape != (self.dof,) or not np.all((self.lower <= self.home) & (self.home <= self.upper)):
            raise ArmError(f"The home posture of {self.name} needs {self.dof} angles within the joint limits.")
        if self.angle_frames is not None:
            frames = self.angle_frames
            for link in (frames.shoulder, frames.elbow, frames.wrist):
                if link not in links:
                    raise ArmError(f"{self.name} has no link {link!r}. Its links: {', '.join(links)}.")

    def commanding(self, redundant: Sequence[str]) -> "Arm":
        """Return the same arm with other joints for ERJ to command (the same object if asked again).

        Args:
            redundant: n-6 of the arm's joints.

        Raises:
            ArmError: not that many, or not the arm's.
        """
        return self if tuple(redundant) == self.redundant else _commanding(self, tuple(redundant))

    def weighing(self, weights: Sequence[Sequence[float]]) -> "Arm":
        """Return the same arm with other weights of ERX's coordinates (the same object if asked again).

        Args:
            weights: (n-6, n) orthonormal rows.

        Raises:
            ArmError: they are not.
        """
        rows = tuple(tuple(map(float, row)) for row in weights)
        return self if rows == self.weights else _weighing(self, rows)

    def _check_weights(self) -> None:
        shape = f"{self.redundancy} rows of {self.dof} numbers, one for each of {', '.join(self.joints)}"
        if len(self.weights) != self.redundancy or any(len(row) != self.dof for row in self.weights):
            raise ArmError(f"The weights of {self.name}'s linear coordinates are not {shape}.")
        W = np.array(self.weights).reshape(self.redundancy, self.dof)
        if not np.all(np.abs(W @ W.T - np.eye(len(W))) < UNIT):  # NaN is not, either
            raise ArmError(f"The weights of {self.name}'s linear coordinates are no orthonormal rows.")

    @property
    def dof(self) -> int:
        """Number of arm joints n."""
        return len(self.joints)

    @property
    def redundancy(self) -> int:
        """Degrees of freedom beyond the pose, n - 6 (0 for arms with six joints or fewer)."""
        return max(0, self.dof - POSE_DOF)

    @cached_property
    def model_xml(self) -> str:
        """The URDF without meshes, every joint outside the arm fixed at zero."""
        return RobotTree.of_element(parse_urdf(self.urdf), self.urdf.name).arm_xml(self.joints)

    @cached_property
    def fingerprint(self) -> str:
        """Short hash of the kinematics between base and end effector; equal for equal geometry."""
        model = pin.buildModelFromXML(self.model_xml)
        data = model.createData()
        order = [model.joints[model.getJointId(joint)].idx_q for joint in self.joints]
        base, ee = model.getFrameId(self.base_frame), model.getFrameId(self.ee_frame)
        digits = []
        for share in (0.3, 0.7):
            q = np.zeros(model.nq)
            q[order] = self.lower + share * (self.upper - self.lower)
            pin.framesForwardKinematics(model, data, q)
            T_base_ee = data.oMf[base].actInv(data.oMf[ee]).homogeneous
            digits.append(np.round(T_base_ee[:3] * 1e4).astype(int).tobytes())
        return hashlib.sha256(b"".join(digits)).hexdigest()[:12]

    def __reduce__(self) -> tuple[object, ...]:
        # Plain fields only: cached values are rebuilt where the arm is unpickled.
        return (type(self), tuple(getattr(self, name) for name in self.__dataclass_fields__))


@lru_cache
def _commanding(arm: Arm, redundant: tuple[str, ...]) -> Arm:
    other = replace(arm, redundant=redundant)
    other._check_redundant()
    return other


@lru_cache
def _weighing(arm: Arm, weights: Weights) -> Arm:
    other = replace(arm, weights=weights)
    other._check_weights()
    return other


def _frozen(values: ArrayLike) -> Vector:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _only_tip(tree: RobotTree) -> str:
    """The link at the end of a tree that has one branch only."""
    if len(tree.tips) != 1:
        raise ArmError(
            f"{tree.file} ends in several links, so name the end-effector frame, such as {', '.join(tree.tips)}."
        )
    return tree.tips[0]


def _angle_frames(tree: RobotTree, joints: Sequence[str]) -> ArmAngleFrames | None:
    """The links at which an arm with seven joints bends; None for other arms, which ERA does not describe."""
    if len(joints) != POSE_DOF + 1:
        return None
    return ArmAngleFrames(*(tree.joint(joints[i]).child for i in (1, 3, 5)))


@lru_cache
def _preset(name: str) -> Arm:
    if name not in PRESETS:
        raise UnknownNameError("arm", name, sorted(PRESETS))
    preset = PRESETS[name]
    arm = Arm.from_urdf(
        preset.urdf(),
        name=name,
        base_frame=preset.base_frame,
        ee_frame=preset.ee_frame,
        joints=preset.joints,
        redundant=preset.redundant,
        home=preset.home,
    )
    return arm.weighing(preset.weights)
