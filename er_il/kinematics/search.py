"""Local search for joint angles that meet a goal: damped steps from a seed, and what to try around it.

The steps are Levenberg-Marquardt's: damping that grows with the squared miss (Sugihara 2011) keeps
them short near a singularity, where undamped ones leap to another branch of solutions, and vanishes
as the goal is met, so that the last steps are quadratic. Undamped, they are Gauss and Newton's, each
taken as it comes: what a solver does that follows the Jacobian's pseudo-inverse.

Where a goal determines the joints (a pose and a redundancy), solutions come in pairs that meet at a singularity,
the fold. Near it the seed may lie closer to the one of the pair that the steps did not find.
"""

import math
from functools import lru_cache

import numpy as np
import placo
from numpy.typing import NDArray
from scipy.linalg import lapack

from er_il.arms.arm import POSE_DOF, Arm, Vector
from er_il.kinematics.forward import ForwardKinematics
from er_il.kinematics.goal import POSITION_TOLERANCE, Attempt, Goal, Miss
from er_il.kinematics.qp import PoseQp
from er_il.kinematics.redundancy import Array

MAX_ITERATIONS = 50
DAMPING_GROWTH = 1e-2  # [1] damping per squared miss in m and rad
CAUTION = 10.0  # damping grows by this factor after a step that overshot, and shrinks after one that did not
FAR = 0.3  # [rad] a solution this far from the seed is looked at with suspicion
CLOSE = 0.12  # [m and rad] goals so close to the seed are tried by quick steps:
QUICK = 5  # at most so many looks at what is left, each at most half of the one before,
LAST = 1e-4  # [m and rad] from here by a last step, whose end is not looked at
POLISH = 1e-8  # [m and rad] solve this far: the last steps are quadratic, and near a fold joints need it
SLOW = 0.95  # a step that leaves more of the miss than this is slow,
PATIENCE = 6  # and so many in a row, the goal still missed, mean that it is out of reach
LIMIT_MARGIN = 1e-4  # [rad] a joint this close to its limit is at it
STALL = 1e-10  # [rad] a step this small changes nothing: stop early
FOLD = 3e-2  # smallest singular value (m and rad mixed) below which another solution may lie close by
FOLD_REACH = 0.5  # [rad] how far away that other solution is looked for
FOLD_MARGIN = 0.05  # [rad] by how much its first guess may look farther from the seed
OPEN = 5e-2  # smallest singular value at a seed above which it never was worth while to try others (it was to 0.036)
NEAR = 0.3  # [m and rad] a goal this close to the seed deserves further attempts
ASIDE = (0.1, -0.1, 0.2, -0.2)  # [rad] how far beside the seed they start
FEW_ITERATIONS = 12
FOLD_STEP = 1e-4  # [rad] of the finite difference across the fold


class LocalSearch:
    """The search for one arm. Not thread-safe."""

    def __init__(self, kinematics: ForwardKinematics, damped: bool) -> None:
        self.arm = kinematics.arm
        self._kinematics = kinematics
        self._damped = damped
        self.iterations = 0  # of all runs so far
        self._robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, self.arm.model_xml)
        self._programs: dict[tuple[tuple[int, ...], bool, int], PoseQp] = {}

    def quick(self, goal: Goal, start: Vector) -> Attempt | None:
        """The solution close to a start, where undamped steps lead there at once and no fold is near; else None.

        Then the careful steps of :meth:`run` lead there, too, and take longer.
        """
        if not self._determined(goal):
            return None
        program = self._program(goal, False)
        program.aim(goal.T_base_ee, None)
        q, largest = start, CLOSE
        errors = program.place(q)
        for _ in range(QUICK):
            miss = self._measured(goal, q, errors)
            if miss.size > largest:
                return None
            if miss.size <= LAST:
                q = q if goal.equations else program.read()
                near = max(map(abs, (q - start).tolist())) <= FAR
                return self._last(program, q, miss) if near else None
            largest = miss.size / 2.0
            try:
                errors = program.advance(q, miss.equations)
            except RuntimeError:
                return None
            self.iterations += 1
            if goal.equations:
                q = program.read()
        return None

    def _last(self, program: PoseQp, q: Vector, miss: Miss) -> Attempt | None:
        """The end of a Newton step from q, where the program's robot is; None near a fold or a limit."""
        inverse = self._inverse(program, miss)
        if inverse is None:
            return None
        gap = program.gap()
        if miss.equations is not None:
            gap = np.concatenate([gap, miss.equations[1]])
        end = q.copy()
        end[program.free] += inverse @ gap
        return Attempt(end, miss, True, clear=True) if self.arm.within_limits(end).tolist() == end.tolist() else None

    def _inverse(self, program: PoseQp, miss: Miss) -> Array | None:
        """Inverse of the derivative where the program's robot is; None near a fold.

        Where the smallest singular value is above ``FOLD``, no other solution is close by. It is no smaller than one
        over the Frobenius norm of the inverse, which costs less and settles most.
        """
        derivative = program.derivative()
        if miss.equations is not None:
            derivative = np.concatenate([derivative, miss.equations[0].take(program.free, axis=1)])
        *_, inverse, failed = lapack.dgesv(derivative, _eye(len(derivative)))  # pyrefly: ignore[missing-attribute]
        flat = inverse.T.ravel()
        if failed or (flat @ flat >= FOLD**-2 and np.linalg.svd(derivative, compute_uv=False)[-1] <= FOLD):
            return None
        return inverse

    def run(self, goal: Goal, q: Vector, posture: Vector | None = None, limit: int = MAX_ITERATIONS) -> Attempt:
        """Run QP steps from q until the goal is met well within tolerance, or nothing moves any more."""
        program = self._program(goal, posture is not None)
        program.aim(goal.T_base_ee, posture)
        moving, iters, caution, slow = True, 0, 1.0, 0
        miss = self._measured(goal, q, program.place(q))
        while moving and iters < limit and (posture is not None or miss.size > POLISH):
            try:
                damping = caution * DAMPING_GROWTH * miss.size**2 if self._damped else 0.0
                moved = program.step(q, damping, miss.equations)
            except RuntimeError:  # the QP has no solution: keep the last angles, the caller sees the miss
                moving = False
                break
            iters += 1
            missed = self._measured(goal, moved, program.place(moved))
            slow = slow + 1 if missed.size > max(SLOW * miss.size, POSITION_TOLERANCE) else 0
            moving = max(map(abs, (moved - q).tolist())) >= STALL and (posture is not None or slow < PATIENCE)
            if self._damped and posture is None and missed.size > miss.size:
                caution *= CAUTION  # overshot: try a shorter step from the same place
                program.place(q)
            else:
                q, miss, caution = moved, missed, max(1.0, caution / CAUTION)
        self.iterations += iters
        return Attempt(q, miss, moving)

    def _measured(self, goal: Goal, q: Vector, errors: tuple[float, float]) -> Miss:
        """What joint angles q miss, given the position's and the rotation's errors there."""
        pos_err, rot_err = errors
        if goal.redundancy is None or not goal.equations:
            return Miss(pos_err, rot_err, math.hypot(pos_err, rot_err))
        at = goal.redundancy.linearise(q)
        turn = goal.redundancy.difference(at.values, goal.values)
        lengths = at.scale * turn
        size = math.hypot(pos_err, rot_err, *lengths.tolist())
        return Miss(pos_err, rot_err, size, max(map(abs, turn.tolist())), (at.derivative, lengths))

    def retry_nearby(self, goal: Goal, seed: Vector, found: Attempt) -> Attempt | None:
        """A better solution than ``found``, from beside the seed, if there is one.

        Starts lie along the direction in which the goal is least sensitive: where a goal close to
        the seed was missed, or met only far away, a fold or the elbow's axis lay in between. A seed whose smallest
        singular value is above ``OPEN`` is too far from any for that.
        """
        if not self._determined(goal) or self._measured(goal, seed, self._program(goal, False).place(seed)).size > NEAR:
            return None
        _, slopes, right = np.linalg.svd(self.derivative(goal, seed))
        if slopes[-1] > OPEN:
            return None
        v = self._embedded(goal, right[-1])
        starts = (self.arm.within_limits(seed + share * v) for share in ASIDE)
        attempts = [found, *(self.run(goal, start, limit=FEW_ITERATIONS) for start in starts)]
        reached = [attempt for attempt in attempts if attempt.reached]
        return min(reached, key=lambda attempt: float(np.linalg.norm(attempt.q - seed)), default=None)

    def across_fold(self, goal: Goal, found: Attempt, seed: Vector) -> Attempt | None:
        """The solution on the other side of a fold close by, if it exists and is nearer the seed.

        Along the direction v that the map loses at the fold, its slope s(t) = s + t s' vanishes at
        t = -s/s', so the pose of t = 0 returns at t = -2 s/s'. From there the iterations take over.
        """
        if found.clear or not self._determined(goal):
            return None
        left, slopes, right = np.linalg.svd(self.derivative(goal, found.q))
        slope = float(slopes[-1])
        if slope > FOLD:
            return None
        v = self._embedded(goal, right[-1])
        ahead = float(left[:, -1] @ self.derivative(goal, found.q + FOLD_STEP * v) @ right[-1])
        change = (ahead - slope) / FOLD_STEP
        if abs(change) * FOLD_REACH <= 2.0 * slope:
            return None
        guess = self.arm.within_limits(found.q - (2.0 * slope / change) * v)
        distance = np.linalg.norm(found.q - seed) if found.reached else np.inf
        if np.linalg.norm(guess - seed) > distance + FOLD_MARGIN:
            return None
        twin = self.run(goal, guess)
        return twin if twin.reached and np.linalg.norm(twin.q - seed) < distance else None

    def held_by_limit(self, goal: Goal, attempt: Attempt) -> bool:
        """True if a joint would have to pass its limit to come closer to the goal."""
        q, arm = attempt.q, self.arm
        push = self._kinematics.jacobian(q).T @ self._kinematics.pose_gap(goal.T_base_ee, q)
        if attempt.miss.equations is not None:
            matrix, lengths = attempt.miss.equations
            push = push + lengths @ matrix
        at_lower, at_upper = at_limits(arm, q)
        return bool(np.any(((at_lower & (push < 0)) | (at_upper & (push > 0)))[self._free(goal)]))

    def _free(self, goal: Goal) -> NDArray[np.int_]:
        """Indices of the joints that the goal lets move."""
        return self._program(goal, False).free

    def _determined(self, goal: Goal) -> bool:
        """True if the goal has isolated solutions: as many equations as free joints."""
        return self.arm.dof - len(goal.held) == POSE_DOF + goal.equations

    def derivative(self, goal: Goal, q: Vector) -> Array:
        """Derivative of the goal's equations by the free joints, square where it is determined."""
        jacobian = self._kinematics.jacobian(q)
        if goal.redundancy is not None and goal.equations:
            jacobian = np.vstack([jacobian, goal.redundancy.linearise(q).derivative])
        return jacobian[:, self._free(goal)]

    def _embedded(self, goal: Goal, free: Vector) -> Vector:
        """A change of the free joints as one of all joints (n,)."""
        v = np.zeros(self.arm.dof)
        v[self._free(goal)] = free
        return v

    def _program(self, goal: Goal, posture: bool) -> PoseQp:
        key = (goal.held, posture, goal.equations)
        if key not in self._programs:
            self._programs[key] = PoseQp(self._robot, self.arm, goal.held, posture=posture, equations=goal.equations)
        return self._programs[key]


@lru_cache
def _eye(size: int) -> Array:
    return np.eye(size, order="F")


def at_limits(arm: Arm, q: Vector) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks (..., n) of the joints that are at their lower, and at their upper limit, at q (..., n) [rad]."""
    return q - arm.lower < LIMIT_MARGIN, arm.upper - q < LIMIT_MARGIN
