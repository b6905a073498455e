"""The interface of every action space: an invertible pair of ``encode`` and ``decode`` with named dimensions."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import array_api_compat as array_api
import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.chain import constant, detached, to_numpy
from er_il.kinematics.solver import BatchResult, IkResult, Kinematics, Status, kinematics_of
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
    def relative(self) -> bool:
        """True if actions count from the last command."""
        return False

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

    def encode(self, q: Any, start: ArrayLike | None = None) -> Any:
        """Encode joint angles as actions.

        Args:
            q: (n,) [rad], or a trajectory (N, n) in time order: rotations are kept continuous along it. Of a PyTorch
                tensor the actions are one, too, in float64 on the same device.
            start: (n,) [rad] command before the first, which a delta counts from; the first itself if omitted.

        Returns:
            (dim,) or (N, dim).

        Raises:
            BoundsError: a delta is larger than its bounds, so that its decoding would not lead there.
        """
        if array_api.is_torch_array(q):
            return constant(self.encode(to_numpy(q), start), q.double())
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
            current: (n,) [rad] the last command, which a delta counts from, and its IK starts from; the seed if
                omitted. Absolute spaces do not need it.
        """
        command = checked_action(action, self.kind, self.names)
        start = self._within_limits("The seed", seed)
        last = start if current is None else self._within_limits("The current command", current)
        if not math.isfinite(command.sum()):
            return IkResult(start, Status.INVALID)
        return self._decode(command, start, last)

    def conditionings(self, q: Array) -> Vector:
        """:meth:`conditioning` (N,) of many configurations q (N, n) [rad]."""
        return np.full(len(q), np.inf)

    def decode_batch(self, actions: Any, seeds: Any, currents: Any = None) -> BatchResult:
        """Decode many actions at once: the solutions and statuses of :meth:`decode`, row by row.

        Where the space can, one batch solves all but the hard rows. On PyTorch tensors the joints are differentiable
        with respect to the actions.

        Args:
            actions: (N, dim), an array of NumPy, PyTorch or another array library; computed with in float64.
            seeds: (N, n) [rad] the arm's measured angles, of the same library.
            currents: (N, n) [rad] the last commands, which deltas count from; the seeds if omitted.
        """
        xp = array_api.array_namespace(actions, seeds)
        actions, seeds = xp.astype(actions, xp.float64), xp.astype(seeds, xp.float64)
        currents = seeds if currents is None else xp.astype(currents, xp.float64)
        if actions.ndim != 2 or actions.shape[1] != self.dim:
            raise ShapeError(f"{self.kind} actions", actions.shape, f"(N, {self.dim}): {', '.join(self.names)}")
        for what, angles in (("The seeds", seeds), ("The current commands", currents)):
            if angles.shape != (len(actions), self.arm.dof):
                raise ShapeError(what, angles.shape, f"({len(actions)}, {self.arm.dof})")
        q, solved = self._solve_batch(detached(actions), detached(seeds))
        result = BatchResult(q, np.full(len(q), Status.OK, dtype="U16"), np.zeros(len(q)), np.zeros(len(q)))
        rows = to_numpy(actions), to_numpy(seeds), to_numpy(currents)
        for row in np.flatnonzero(~to_numpy(solved)):
            decoded = self.decode(*(each[row] for each in rows))
            q[row] = constant(decoded.q, q)
            result.status[row] = decoded.status
            result.pos_err[row], result.rot_err[row] = decoded.pos_err, decoded.rot_err
        followed = self._follow(q, actions, result.status)
        return result if followed is None else replace(result, q=followed)

    def _solve_batch(self, actions: Any, seeds: Any) -> tuple[Any, Any]:
        """Joint angles (N, n) [rad], and a mask (N,) of the rows that were decoded; the others are decoded singly."""
        xp = array_api.array_namespace(actions)
        return xp.asarray(seeds, copy=True), xp.zeros((len(actions),), dtype=xp.bool)

    def _follow(self, q: Any, actions: Any, status: NDArray[np.str_]) -> Any:
        """The solutions q (N, n) as functions of the actions, for automatic derivatives; None if there are none."""
        return None

    def steady(self, action: ArrayLike, seed: Vector) -> Vector | None:
        """Joint angles (n,) [rad] that do all an action determines and else stay near a seed.

        None where the action determines all joints, as it nearly always does: they are what it decodes to.

        Args:
            action: (dim,), finite.
            seed: (n,) [rad] the arm's measured angles.
        """
        return None

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
        return self.arm.within_limits(given)


def checked_action(action: ArrayLike, kind: str, names: tuple[str, ...]) -> Vector:
    """Return an action (len(names),) as an array.

    Raises:
        ShapeError: it has another length.
    """
    command = np.asarray(action, dtype=np.float64)
    if command.shape != (len(names),):
        raise ShapeError(f"A {kind} action", command.shape, f"({len(names)},): {', '.join(names)}")
    return command
