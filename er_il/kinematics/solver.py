"""Kinematics of an arm: Pinocchio's forward kinematics, and inverse kinematics by Placo's QP."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.forward import ForwardKinematics
from er_il.kinematics.search import LIMIT_MARGIN, Attempt, Goal, LocalSearch
from er_il.support.errors import UnknownNameError

FAR = 0.3  # [rad] a solution this far from the seed is looked at with suspicion


class Status(StrEnum):
    """What became of a decoded action."""

    OK = "ok"
    INVALID = "invalid"  # not finite, or no rotation
    UNREACHABLE = "unreachable"  # no way closer to the pose, with what else is commanded, from where the arm is
    LIMIT = "limit"  # reached, if a joint could pass its limit; or a commanded value beyond its own
    NOT_CONVERGED = "not_converged"  # still approaching when the iterations ran out
    JUMP = "jump"  # solved, but farther from the current posture than the arm moves in a period


@dataclass(frozen=True)
class IkResult:
    """Outcome of :meth:`Kinematics.solve`; ``q`` is the best effort whatever the status."""

    q: Vector  # (n,) [rad]
    status: Status
    pos_err: float  # [m]
    rot_err: float  # [rad]
    iters: int  # of all attempts


class Kinematics(ForwardKinematics):
    """Forward and inverse kinematics of one arm. Not thread-safe: see :func:`kinematics_of`."""

    def __init__(self, arm: Arm, damped: bool = True) -> None:
        super().__init__(arm)
        self._search = LocalSearch(self, damped)

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
        before = self._search.iterations
        if posture is not None:
            start = self._search.run(goal, start, self._checked(posture)).q
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
        return IkResult(found.q, status, found.miss.position, found.miss.rotation, self._search.iterations - before)

    def conditioning(self, q: ArrayLike, fixed: Collection[str] = (), *, arm_angle: bool = False) -> float:
        """How far a configuration is from a singularity of what is commanded.

        The smallest singular value, in metres and radians mixed, of the end effector's Jacobian by
        the joints that are not ``fixed`` (ERJ), with the elbow's way along its circle as a seventh
        row if the arm angle is commanded (ERA). At 0 two solutions meet.
        """
        goal = Goal(np.eye(4), 0.0 if arm_angle else None, frozenset(fixed))
        return float(np.linalg.svd(self._search.derivative(goal, self._checked(q)), compute_uv=False)[-1])

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
