"""What every action space is: an invertible pair of ``encode`` and ``decode`` with named dimensions."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.solver import Kinematics, Status, kinematics_of
from er_il.spaces.spec import SPEC_VERSION
from er_il.support.errors import ShapeError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Decoded:
    """A joint command and what became of the action it came from.

    ``q`` is finite and within the joint limits whatever the status: the best effort, or the seed
    where the action means nothing.
    """

    q: Vector  # (n,) [rad]
    gripper: float  # in [0, 1], 1 open
    status: Status
    pos_err: float = 0.0  # [m]
    rot_err: float = 0.0  # [rad]
    iters: int = 0


@dataclass(frozen=True, eq=False)
class ActionSpace(ABC):
    """An action space of one arm and its gripper.

    The last dimension of an action is the gripper's opening in [0, 1].
    """

    arm: Arm

    kind: ClassVar[str]

    @property
    @abstractmethod
    def arm_names(self) -> tuple[str, ...]:
        """Names of the dimensions that command the arm."""

    @abstractmethod
    def _encode_arm(self, q: Array) -> Array:
        """Encode a trajectory q (N, n) [rad] as (N, dim - 1)."""

    @abstractmethod
    def _decode_arm(self, action: Vector, seed: Vector, current: Vector) -> Decoded:
        """Decode a finite action (dim - 1,); the gripper is filled in by the caller."""

    @abstractmethod
    def _details(self) -> dict[str, Any]:
        """What the specification holds beyond the kind, the arm and the names."""

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each dimension of an action."""
        return (*self.arm_names, "gripper")

    @property
    def dim(self) -> int:
        """Length of an action."""
        return len(self.names)

    @property
    def kinematics(self) -> Kinematics:
        """The arm's kinematics in this process."""
        return kinematics_of(self.arm)

    def fk(self, q: ArrayLike) -> Array:
        """End-effector pose ``T_base_ee`` (4, 4) at q (n,) [rad]."""
        return self.kinematics.fk(q)

    def encode(self, q: ArrayLike, gripper: ArrayLike = 1.0) -> Array:
        """Encode joint angles as actions.

        Args:
            q: (n,) [rad], or a trajectory (N, n) in time order: rotations are kept continuous along it.
            gripper: Opening in [0, 1], one value or (N,).

        Returns:
            (dim,) or (N, dim).
        """
        angles = np.asarray(q, dtype=np.float64)
        if angles.ndim not in (1, 2) or angles.shape[-1] != self.arm.dof:
            raise ShapeError("Joint angles", angles.shape, f"({self.arm.dof},) or (N, {self.arm.dof})")
        batch = np.atleast_2d(angles)
        opening = np.broadcast_to(np.asarray(gripper, dtype=np.float64), len(batch))
        action = np.column_stack([self._encode_arm(batch), opening])
        return action[0] if angles.ndim == 1 else action

    def decode(self, action: ArrayLike, seed: ArrayLike, current: ArrayLike | None = None) -> Decoded:
        """Decode an action to joint angles near a seed.

        Args:
            action: (dim,) as a policy gives it; rotations are normalised, the gripper is clipped.
            seed: (n,) [rad] the arm's measured angles, where IK starts.
            current: (n,) [rad] the last command, which a delta counts from; the seed if omitted.
                Absolute spaces do not need it.
        """
        command = np.asarray(action, dtype=np.float64)
        start = np.asarray(seed, dtype=np.float64)
        if command.shape != (self.dim,):
            raise ShapeError(f"A {self.kind} action", command.shape, f"({self.dim},): {', '.join(self.names)}")
        last = start if current is None else np.asarray(current, dtype=np.float64)
        for what, angles in (("The seed", start), ("The current command", last)):
            if angles.shape != (self.arm.dof,):
                raise ShapeError(what, angles.shape, f"({self.arm.dof},)")
        start = np.clip(start, self.arm.lower, self.arm.upper)
        opening = float(np.clip(command[-1], 0.0, 1.0)) if np.isfinite(command[-1]) else 1.0
        if not np.all(np.isfinite(command)):
            return Decoded(start, opening, Status.INVALID)
        decoded = self._decode_arm(command[:-1], start, np.clip(last, self.arm.lower, self.arm.upper))
        return Decoded(decoded.q, opening, decoded.status, decoded.pos_err, decoded.rot_err, decoded.iters)

    def spec(self) -> dict[str, Any]:
        """Describe the space as JSON, to travel with datasets (see :func:`er_il.spaces.from_spec`)."""
        arm = self.arm
        return {
            "version": SPEC_VERSION,
            "space": self.kind,
            "arm": {
                "name": arm.name,
                "urdf": arm.urdf.name,
                "joints": list(arm.joints),
                "base_frame": arm.base_frame,
                "ee_frame": arm.ee_frame,
                "redundant": list(arm.redundant),
                "fingerprint": arm.fingerprint,
            },
            "names": list(self.names),
            **self._details(),
        }
