"""Task space and the ER spaces: an end-effector pose, then the values of a redundancy, if any (paper III-A, IV)."""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.kinematics.redundancy import Redundancy
from er_il.kinematics.rotation import Quaternion, RotationCode, RotationError
from er_il.kinematics.solver import IkResult, Kinematics, Status, kinematics_of
from er_il.spaces.base import ArmSpace, Array

POSITION_NAMES = ("ee.x", "ee.y", "ee.z")
TASK = "task"
EASED = (0.5, 0.2, 0.1, 0.0)  # shares of the way to a redundancy value that is too far
POSTURE_PULL = 0.05  # [rad] of the joint farthest from the posture; at 20 Hz, half a Panda's full speed


@dataclass(frozen=True, eq=False)
class PoseSpace(ArmSpace):
    """Position [m] and rotation of the end effector in the base frame, then redundancy values [rad].

    Without a redundancy this is task space, whose action leaves the elbow to IK: ``posture`` None takes the solution
    nearest the seed (minimal displacement), a posture (n,) [rad] one that is nearer to it than the seed, by at most
    ``POSTURE_PULL`` a decode: the null space then moves as a controller on a robot would move it, not by a jump.

    ``damped`` selects the steps of IK (see :mod:`er_il.kinematics.search`); it is no part of what an action means.
    """

    rotation: RotationCode
    er_kind: str = ""  # kind of the ER space; task space if empty
    redundancy: Redundancy | None = None
    posture: Vector | None = None
    damped: bool = field(default=True, kw_only=True)

    @property
    def kind(self) -> str:
        return self.er_kind or TASK

    @property
    def kinematics(self) -> Kinematics:
        return kinematics_of(self.arm, self.damped)

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        """Names of the redundancy values; () in task space."""
        return () if self.redundancy is None else self.redundancy.names

    @property
    def names(self) -> tuple[str, ...]:
        return (*POSITION_NAMES, *self.rotation.names, *self.redundancy_names)

    def redundancy_along(self, q: Array) -> Array:
        """Redundancy values (N, m) along a trajectory q (N, n) [rad]."""
        return np.empty((len(q), 0)) if self.redundancy is None else self.redundancy.along(q)

    def conditioning(self, q: ArrayLike) -> float:
        return self.kinematics.conditioning(q, self.redundancy)

    def solve(self, T_base_ee: Array, values: Vector, seed: Vector) -> IkResult:
        """Find joint angles with a pose (4, 4) and redundancy values (m,), near a seed (n,) [rad]."""
        if self.posture is None:
            return self.kinematics.solve(T_base_ee, seed, self.redundancy, values)
        way = self.posture - seed
        share = min(1.0, POSTURE_PULL / max(float(np.max(np.abs(way))), POSTURE_PULL))
        return self.kinematics.solve(T_base_ee, seed, self.redundancy, values, posture=seed + share * way)

    def ease(self, action: ArrayLike, seed: Vector, within: Vector, current: Vector) -> Vector | None:
        return self.ease_pose(*self.split(np.asarray(action, dtype=np.float64)), seed, within)

    def ease_pose(self, T_base_ee: Array, values: Vector, seed: Vector, within: Vector) -> Vector | None:
        """Meet a pose near a seed, and of redundancy values as much as lies on the way.

        Near a singularity of the redundancy (for ERA on a Panda: the upper arm vertical), a value that is off by a
        hundredth of a radian, as a policy's is, belongs to an elbow far away. The pose is met all the same.

        Args:
            T_base_ee: (4, 4) pose.
            values: (m,) redundancy values that decode to joints far from the seed.
            seed: (n,) [rad] the arm's measured angles.
            within: (n,) [rad] how far each joint may be from the seed.

        Returns:
            Joint angles (n,) [rad]; if no redundancy between the seed's and the action's brings them near, those
            nearest the seed with the pose alone. None in task space, which commands no redundancy.
        """
        if self.redundancy is None:
            return None
        start = np.clip(seed, self.arm.lower, self.arm.upper)
        present = self.redundancy.along(start[None])[0]
        for share in EASED:
            ik = self.solve(T_base_ee, present + share * self.redundancy.difference(present, values), start)
            if ik.status is Status.OK and np.all(np.abs(ik.q - start) <= within):
                return ik.q
        return self.kinematics.solve(T_base_ee, start).q

    def fitted(self, postures: Array) -> Self:
        """The same space with the redundancy's conventions that suit postures (N, n) [rad]."""
        return self if self.redundancy is None else replace(self, redundancy=self.redundancy.fitted(postures))

    def split(self, action: Vector) -> tuple[Array, Vector]:
        """The pose (4, 4) and the redundancy values (m,) of an action (dim,).

        Raises:
            RotationError: its rotation is none.
        """
        split = len(POSITION_NAMES) + len(self.rotation.names)
        T_base_ee = np.eye(4)
        T_base_ee[:3, 3] = action[:3]
        T_base_ee[:3, :3] = self.rotation.decode(action[3:split])
        return T_base_ee, action[split:]

    def _encode(self, q: Array) -> Array:
        T_base_ee = self.kinematics.fk_batch(q)
        rotation = self.rotation.encode(T_base_ee[:, :3, :3])
        return np.column_stack([T_base_ee[:, :3, 3], rotation, self.redundancy_along(q)])

    def _decode(self, action: Vector, seed: Vector, current: Vector) -> IkResult:
        try:
            T_base_ee, values = self.split(action)
        except RotationError:
            return IkResult(seed, Status.INVALID)
        return self.solve(T_base_ee, values, seed)

    def _details(self) -> dict[str, Any]:
        details: dict[str, Any] = {"rotation": self.rotation.kind}
        if isinstance(self.rotation, Quaternion):
            details["hemisphere"] = list(self.rotation.reference)
        return details | ({} if self.redundancy is None else self.redundancy.details())
