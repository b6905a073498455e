"""The interface of every action space: an invertible pair of ``encode`` and ``decode`` with named dimensions."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.solver import IkResult, Kinematics, Status, kinematics_of
from er_il.spaces.spec import SPEC_VERSION
from er_il.support.errors import ShapeError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ArmSpace(ABC):
    """An action space of one arm, without its gripper."""

    arm: Arm

    @property
    @abstractmethod
    def kind(self) -> str:
        """Name of the space in a specification, such as ``erj``."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Name of each dimension of an action."""

    @abstractmethod
    def _encode(self, q: Array) -> Array:
        """Encode a trajectory q (N, n) [rad] as (N, dim)."""

    @abstractmethod
    def _decode(self, action: Vector, seed: Vector, current: Vector) -> IkResult:
        """Decode a finite action (dim,) from a seed and a last command within the joint limits."""

    @abstractmethod
    def _details(self) -> dict[str, Any]:
        """The specification beyond the kind, the arm and the names."""

    @property
    def dim(self) -> int:
        """Length of an action."""
        return len(self.names)

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        """Lowest and highest value (dim,) of each dimension; infinite where the space declares none."""
        return np.full(self.dim, -np.inf), np.full(self.dim, np.inf)

    @property
    def kinematics(self) -> Kinematics:
        """The arm's kinematics in this process."""
        return kinematics_of(self.arm)

    def fk(self, q: ArrayLike) -> Array:
        """End-effector pose ``T_base_ee`` (4, 4) at q (n,) [rad]."""
        return self.kinematics.fk(q)

    def conditioning(self, q: ArrayLike) -> float:
        """Distance of q (n,) [rad] from a singularity of the space; infinite where decoding solves nothing."""
        return np.inf

    def encode(self, q: ArrayLike, start: ArrayLike | None = None) -> Array:
        """Encode joint angles as actions.

        Args:
            q: (n,) [rad], or a trajectory (N, n) in time order: rotations are kept continuous along it.
            start: (n,) [rad] command before the first, which a delta counts from; the first itself if omitted.

        Returns:
            (dim,) or (N, dim).

        Raises:
            BoundsError: a delta is larger than its bounds, so that its decoding would not lead there.
        """
        angles = np.asarray(q, dtype=np.float64)
        if angles.ndim not in (1, 2) or angles.shape[-1] != self.arm.dof:
            raise ShapeError("Joint angles", angles.shape, f"({self.arm.dof},) or (N, {self.arm.dof})")
        batch = np.atleast_2d(angles)
        if start is not None:
            if np.shape(start) != (self.arm.dof,):
                raise ShapeError("The start", np.shape(start), f"({self.arm.dof},)")
            batch = np.vstack([start, batch])
        action = self._encode(batch)[0 if start is None else 1 :]
        return action[0] if angles.ndim == 1 else action

    def decode(self, action: ArrayLike, seed: ArrayLike, current: ArrayLike | None = None) -> IkResult:
        """Decode an action to joint angles near a seed.

        Args:
            action: (dim,) as a policy gives it; rotations are normalised.
            seed: (n,) [rad] the arm's measured angles, where IK starts.
            current: (n,) [rad] the last command, which a delta counts from; the seed if omitted.
                Absolute spaces do not need it.
        """
        command = checked_action(action, self.kind, self.names)
        start, last = self._within_limits("The seed", seed), seed if current is None else current
        if not np.all(np.isfinite(command)):
            return IkResult(start, Status.INVALID)
        return self._decode(command, start, self._within_limits("The current command", last))

    def ease(self, action: ArrayLike, seed: Vector, within: Vector, current: Vector) -> Vector | None:
        """Joint angles (n,) [rad] near a seed that do as much of an action as lies on the way; None if there are none.

        Args:
            action: (dim,) that decodes to joints far from the seed.
            seed: (n,) [rad] the arm's measured angles.
            within: (n,) [rad] how far each joint may be from the seed.
            current: (n,) [rad] the last command, which a delta counts from.
        """
        return None

    def spec(self) -> dict[str, Any]:
        """Describe the space as JSON; :func:`er_il.spaces.registry.arm_space_from_spec` rebuilds it."""
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

    def _within_limits(self, what: str, angles: ArrayLike) -> Vector:
        given = np.asarray(angles, dtype=np.float64)
        if given.shape != (self.arm.dof,):
            raise ShapeError(what, given.shape, f"({self.arm.dof},)")
        return np.clip(given, self.arm.lower, self.arm.upper)


def checked_action(action: ArrayLike, kind: str, names: tuple[str, ...]) -> Vector:
    """Return an action (len(names),) as an array.

    Raises:
        ShapeError: it has another length.
    """
    command = np.asarray(action, dtype=np.float64)
    if command.shape != (len(names),):
        raise ShapeError(f"A {kind} action", command.shape, f"({len(names)},): {', '.join(names)}")
    return command
