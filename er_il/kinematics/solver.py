"""Kinematics of an arm: Pinocchio's forward kinematics, and inverse kinematics by Placo's QP."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.batch import BatchSearch
from er_il.kinematics.chain import chunks, to_numpy
from er_il.kinematics.forward import ForwardKinematics
from er_il.kinematics.goal import Attempt, Goal
from er_il.kinematics.redundancy import Array, Redundancy
from er_il.kinematics.search import FAR, LIMIT_MARGIN, LocalSearch
from er_il.support.errors import ShapeError


class Status(StrEnum):
    """Outcome of decoding an action."""

    OK = "ok"
    INVALID = "invalid"  # not finite, or no rotation
    UNREACHABLE = "unreachable"  # no way closer to the pose, with what else is commanded, from where the arm is
    LIMIT = "limit"  # reached, if a joint could pass its limit; or a commanded value beyond its own
    NOT_CONVERGED = "not_converged"  # still approaching when the iterations ran out
    JUMP = "jump"  # solved, but farther from the current posture than the arm moves in a period


@dataclass(frozen=True, eq=False)
class BatchResult:
    """Joint angles found for N actions; see :class:`IkResult`."""

    q: Any  # (N, n) [rad] an array of the library that the actions are of
    status: NDArray[np.str_]  # (N,) of Status
    pos_err: Array  # (N,) [m]
    rot_err: Array  # (N,) [rad]

    @classmethod
    def of(cls, results: "Sequence[IkResult]") -> "BatchResult":
        """Results of the single solver, one after the other."""
        return cls(
            np.array([each.q for each in results]),
            np.array([each.status for each in results], dtype="U16"),
            np.array([each.pos_err for each in results]),
            np.array([each.rot_err for each in results]),
        )

    def result(self, row: int) -> "IkResult":
        """The result of one action, as the single solver gives it."""
        errors = float(self.pos_err[row]), float(self.rot_err[row])
        return IkResult(to_numpy(self.q[row]), Status(self.status[row]), *errors)


@dataclass(frozen=True)
class IkResult:
    """Joint angles found for an action, and how exactly they meet it.

    ``q`` is finite and within the joint limits whatever the status: the best effort, or the seed where the action
    means nothing.
    """

    q: Vector  # (n,) [rad]
    status: Status
    pos_err: float = 0.0  # [m]
    rot_err: float = 0.0  # [rad]
    iters: int = 0  # of all attempts


class Kinematics(ForwardKinematics):
    """Forward and inverse kinematics of one arm. Not thread-safe: see :func:`kinematics_of`."""

    def __init__(self, arm: Arm, damped: bool = True) -> None:
        super().__init__(arm)
        self._damped = damped
        self._search = LocalSearch(self, damped)

    def solve(
        self,
        T_base_ee: ArrayLike,
        seed: ArrayLike,
        redundancy: Redundancy | None = None,
        values: ArrayLike = (),
        *,
        posture: ArrayLike | None = None,
    ) -> IkResult:
        """Find joint angles that reach a pose, starting from a seed.

        Without ``posture`` the iterations move as little as they need to: of all solutions the
        one near the seed. With it, the null space is first pulled towards that posture; the last
        iterations drop the pull, so that the pose is met as exactly as without.

        Args:
            T_base_ee: (4, 4) target pose.
            seed: (n,) [rad] start of the iterations; clipped to the limits.
            redundancy: What else is commanded.
            values: (m,) [rad] its values. A joint's angle outside its limits is clipped and reported as
                ``Status.LIMIT``; any turn of an arm angle is the same.
            posture: (n,) [rad] preferred configuration in the null space.

        Raises:
            ShapeError: there are not as many values as the redundancy has names.
        """
        arm = self.arm
        wanted = np.asarray(values, dtype=np.float64)
        names = () if redundancy is None else redundancy.names
        if wanted.shape != (len(names),):
            raise ShapeError("The redundancy's values", wanted.shape, f"({len(names)},): {', '.join(names)}")
        goal = Goal(np.asarray(T_base_ee, dtype=np.float64), redundancy, wanted)
        start = arm.within_limits(self._checked(seed))
        clipped = False
        for joint, angle in zip(goal.held, wanted if goal.held else (), strict=True):
            start[joint] = min(max(angle, arm.lower[joint]), arm.upper[joint])
            clipped |= bool(abs(start[joint] - angle) > LIMIT_MARGIN)
        before = self._search.iterations
        if posture is not None:
            start = self._search.run(goal, start, self._checked(posture)).q
        found = self._search.quick(goal, start) if posture is None else None
        if found is None:
            found = self._search.run(goal, start)
        if posture is None:
            found = self._search.across_fold(goal, found, start) or found
            if not found.reached or max(map(abs, (found.q - start).tolist())) > FAR:
                found = self._search.retry_nearby(goal, start, found) or found
        if clipped:
            status = Status.LIMIT
        elif found.reached:
            status = Status.OK
        else:
            status = self._why_not(found, goal)
        return IkResult(found.q, status, found.miss.position, found.miss.rotation, self._search.iterations - before)

    def batch(self, redundancy: Redundancy | None) -> BatchSearch:
        """The search for many goals at once that command a redundancy."""
        return BatchSearch(self.arm, self.chain, self.mounted(), redundancy, self._damped)

    def conditioning(self, q: ArrayLike, redundancy: Redundancy | None = None) -> float:
        """Distance of a configuration q (n,) [rad] from a singularity of what is commanded.

        The smallest singular value, in metres and radians mixed, of the end effector's Jacobian by the joints that
        the redundancy does not hold (ERJ), with the redundancy's scaled derivative below it otherwise (ERA: the
        elbow's way along its circle). At 0 two solutions meet.
        """
        goal = Goal(np.eye(4), redundancy)
        return float(np.linalg.svd(self._search.derivative(goal, self._checked(q)), compute_uv=False)[-1])

    def conditionings(self, q: Array, redundancy: Redundancy | None = None) -> Vector:
        """:meth:`conditioning` (N,) of many configurations q (N, n) [rad]."""
        search, smallest = self.batch(redundancy), np.empty(len(q))
        for rows in chunks(len(q)):
            derivative = search.derivative(self.chain.walk(q[rows])).transpose(2, 0, 1)
            smallest[rows] = np.linalg.svd(derivative, compute_uv=False)[:, -1]
        return smallest

    def _why_not(self, attempt: Attempt, goal: Goal) -> Status:
        if not self.within_reach(goal.T_base_ee[:3, 3]):
            return Status.UNREACHABLE  # stretched towards it, joints come to their limits too
        if self._search.held_by_limit(goal, attempt):
            return Status.LIMIT
        return Status.NOT_CONVERGED if attempt.moving else Status.UNREACHABLE


@lru_cache
def kinematics_of(arm: Arm, damped: bool = True) -> Kinematics:
    """The process's kinematics of an arm, built on first use; ``damped``: see :mod:`er_il.kinematics.search`."""
    return Kinematics(arm, damped)
