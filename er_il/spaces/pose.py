"""What task space and the ER spaces share: an end-effector pose, then the redundancy, if any."""

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.kinematics.rotation import Quaternion, RotationCode, RotationError
from er_il.kinematics.solver import IkResult, Kinematics, Status, kinematics_of
from er_il.spaces.base import ActionSpace, Array, Decoded

POSITION_NAMES = ("ee.x", "ee.y", "ee.z")
EASED = (0.5, 0.2, 0.1, 0.0)  # shares of the way to a redundancy value that is too far


@dataclass(frozen=True, eq=False)
class PoseSpace(ActionSpace):
    """Position [m] and rotation of the end effector in the base frame, then redundancy values [rad].

    ``damped`` says how IK steps (see :mod:`er_il.kinematics.search`); it is no part of what an action means.
    """

    rotation: RotationCode
    damped: bool = field(default=True, kw_only=True)

    @property
    def kinematics(self) -> Kinematics:
        return kinematics_of(self.arm, self.damped)

    @property
    @abstractmethod
    def redundancy_names(self) -> tuple[str, ...]:
        """Names of the redundancy values."""

    @abstractmethod
    def redundancy(self, q: Array) -> Array:
        """Redundancy values (N, len(redundancy_names)) along a trajectory q (N, n) [rad]."""

    @abstractmethod
    def solve(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> IkResult:
        """Find joint angles with that pose (4, 4) and those redundancy values, near the seed (n,)."""

    def conditioning(self, q: ArrayLike) -> float:
        """Distance of q (n,) [rad] from a singularity: see :meth:`er_il.kinematics.solver.Kinematics.conditioning`."""
        return self.kinematics.conditioning(q)

    @property
    def arm_names(self) -> tuple[str, ...]:
        return (*POSITION_NAMES, *self.rotation.names, *self.redundancy_names)

    def _encode_arm(self, q: Array) -> Array:
        T_base_ee = self.kinematics.fk_batch(q)
        return np.column_stack([T_base_ee[:, :3, 3], self.rotation.encode(T_base_ee[:, :3, :3]), self.redundancy(q)])

    def _decode_arm(self, action: Vector, seed: Vector, current: Vector) -> Decoded:
        try:
            T_base_ee, redundancy = self._split(action)
        except RotationError:
            return Decoded(seed, 0.0, Status.INVALID)
        return self.decode_pose(T_base_ee, redundancy, seed)

    def _split(self, action: Vector) -> tuple[Array, Vector]:
        """The pose (4, 4) and the redundancy values of a command (dim - 1,).

        Raises:
            RotationError: its rotation is none.
        """
        split = len(POSITION_NAMES) + len(self.rotation.names)
        T_base_ee = np.eye(4)
        T_base_ee[:3, 3] = action[:3]
        T_base_ee[:3, :3] = self.rotation.decode(action[3:split])
        return T_base_ee, action[split:]

    def ease(self, action: ArrayLike, seed: Vector, within: Vector) -> Vector:
        """Meet an action's pose near a seed, and of its redundancy as much as lies on the way.

        Near a singularity of what is commanded (for ERA on a Panda: the upper arm vertical), a redundancy value that is
        off by a hundredth of a radian, as a policy's is, belongs to an elbow far away. The pose is met all the same.

        Args:
            action: (dim,) with redundancy values, that decodes to joints far from the seed.
            seed: (n,) [rad] the arm's measured angles.
            within: (n,) [rad] how far each joint may be from the seed.

        Returns:
            Joint angles (n,) [rad]; if no redundancy between the seed's and the action's brings them near, those
            nearest the seed with the pose alone.
        """
        command = np.asarray(action, dtype=np.float64)[:-1]
        T_base_ee, wanted = self._split(command)
        start = np.clip(seed, self.arm.lower, self.arm.upper)
        present = self.redundancy(start[None])[0]
        for share in EASED:
            ik = self.solve(T_base_ee, present + share * self.change(present, wanted), start)
            if ik.status is Status.OK and np.all(np.abs(ik.q - start) <= within):
                return ik.q
        return self.kinematics.solve(T_base_ee, start).q

    def change(self, start: Vector, end: Vector) -> Vector:
        """The way from one set of redundancy values to another."""
        return end - start

    def decode_pose(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> Decoded:
        """Decode a pose (4, 4) and redundancy values; the gripper is left at 0."""
        ik = self.solve(T_base_ee, redundancy, seed)
        return Decoded(ik.q, 0.0, ik.status, ik.pos_err, ik.rot_err, ik.iters)

    def _details(self) -> dict[str, Any]:
        details: dict[str, Any] = {"rotation": self.rotation.kind}
        if isinstance(self.rotation, Quaternion):
            details["hemisphere"] = list(self.rotation.reference)
        return details
