"""Kinematics of an arm: Pinocchio's forward kinematics, and inverse kinematics by Placo's QP."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from er_il.arm import Arm, Vector
from er_il.arm_angle import ArmAngle
from er_il.errors import UnknownNameError
from er_il.forward import ForwardKinematics
from er_il.search import Attempt, Goal, LocalSearch

FAR = 0.3  # [rad] a solution this far from the seed is looked at with suspicion
LIMIT_MARGIN = 1e-4  # [rad] a joint this close to its limit is at it


class Status(StrEnum):
    """What became of a decoded action."""

    OK = "ok"
    INVALID = "invalid"  # not finite, or no rotation
    UNREACHABLE = "unreachable"  # the pose is out of reach with what is fixed
    LIMIT = "limit"  # a joint limit stands between the solution and the pose
    NOT_CONVERGED = "not_converged"  # still approaching when the iterations ran out
    JUMP = "jump"  # solved, but farther from the current posture than the arm moves in a period


@dataclass(frozen=True)
class IkResult:
    """Outcome of :meth:`Kinematics.solve`; ``q`` is the best effort whatever the status."""

    q: Vector  # (n,) [rad]
    status: Status
    pos_err: float  # [m]
    rot_err: float  # [rad]
    iters: int


class Kinematics(ForwardKinematics):
    """Forward and inverse kinematics of one arm. Not thread-safe: see :func:`kinematics_of`."""

    def __init__(self, arm: Arm) -> None:
        super().__init__(arm)
        self._search = LocalSearch(self)

    @property
    def arm_angle(self) -> ArmAngle:
        """The arm angle as a function of the joints.

        Raises:
            ArmError: the arm names no shoulder, elbow and wrist.
        """
        return self._search.arm_angle

    def solve(
        self,
        T_base_ee: ArrayLike,
        seed: ArrayLike,
        fixed: Mapping[str, float] | None = None,
        posture: ArrayLike | None = None,
        arm_angle: float | None = None,
    ) -> IkResult:
        """Find joint angles that reach a pose, starting from a seed.

        Without ``posture`` the iterations move as little as they need to: of all solutions the
        one near the seed. With it, the null space is first pulled towards that posture; the last
        iterations drop the pull, so that the pose is met as exactly as without.

        Args:
            T_base_ee: (4, 4) target pose.
            seed: (n,) [rad] start of the iterations; clipped to the limits.
            fixed: Joints that keep a given angle [rad] (ERJ's commanded joints). An angle outside
                its limits is clipped and reported as ``Status.LIMIT``.
            posture: (n,) [rad] preferred configuration in the null space.
            arm_angle: [rad] ERA's arm angle; any turn of it is the same.
        """
        arm = self.arm
        fixed = dict(fixed or {})
        start = np.clip(self._checked(seed), arm.lower, arm.upper)
        clipped = False
        for joint, angle in fixed.items():
            if joint not in arm.joints:
                raise UnknownNameError("joint", joint, arm.joints)
            i = arm.joints.index(joint)
            start[i] = np.clip(angle, arm.lower[i], arm.upper[i])
            clipped |= abs(start[i] - angle) > LIMIT_MARGIN
        goal = Goal(np.asarray(T_base_ee, dtype=np.float64), arm_angle, frozenset(fixed))
        pulled = 0
        if posture is not None:
            pull = self._search.run(goal, start, self._checked(posture))
            start, pulled = pull.q, pull.iters
        found = self._search.run(goal, start)
        if posture is None:
            found = self._search.across_fold(goal, found, start) or found
            if not found.reached or np.abs(found.q - start).max() > FAR:
                found = self._search.beside(goal, start, found) or found
        if clipped:
            status = Status.LIMIT
        elif found.reached:
            status = Status.OK
        else:
            status = self._why_not(found, goal)
        return IkResult(found.q, status, found.miss.position, found.miss.rotation, pulled + found.iters)

    def conditioning(self, q: ArrayLike, fixed: Collection[str] = (), *, arm_angle: bool = False) -> float:
        """How far a configuration is from a singularity of what is commanded.

        The smallest singular value, in metres and radians mixed, of the end effector's Jacobian by
        the joints that are not ``fixed`` (ERJ), with the elbow's way along its circle as a seventh
        row if the arm angle is commanded (ERA). At 0 two solutions meet.
        """
        goal = Goal(np.eye(4), 0.0 if arm_angle else None, frozenset(fixed))
        return float(np.linalg.svd(self._search.derivative(goal, self._checked(q)), compute_uv=False)[-1])

    def _why_not(self, attempt: Attempt, goal: Goal) -> Status:
        q, arm = attempt.q, self.arm
        if np.any(((q - arm.lower < LIMIT_MARGIN) | (arm.upper - q < LIMIT_MARGIN)) & self._search.free(goal)):
            return Status.LIMIT
        return Status.NOT_CONVERGED if attempt.moving else Status.UNREACHABLE


@lru_cache
def kinematics_of(arm: Arm) -> Kinematics:
    """The process's kinematics of an arm, built on first use."""
    return Kinematics(arm)
