"""Inverse kinematics of many goals at once, on arrays of NumPy, PyTorch or another array library.

The steps are those of :mod:`er_il.kinematics.search` without a program: the same damping, the same longest step. They
solve what needs no more: a goal near the seed, its solution inside the limits and away from folds. The rest is left
to the single solver.
"""

from dataclasses import dataclass
from typing import Any

import array_api_compat as array_api
import numpy as np

from er_il.arms.arm import Arm
from er_il.kinematics.chain import Chain, Mounted, Walk, constant
from er_il.kinematics.qp import MAX_STEP, MIN_DAMPING
from er_il.kinematics.redundancy import Redundancy
from er_il.kinematics.search import DAMPING_GROWTH, FOLD, LAST

MAX_STEPS = 12  # more are left to the single solver
LEAST = 1e-12  # [1] keeps the square of a derivative invertible
STRAIGHT = np.pi - 0.1  # [rad] errors of a rotation above this have no certain axis


@dataclass(frozen=True, eq=False)
class BatchGoal:
    """N poses and redundancy values to reach; arrays of one library."""

    R: Any  # (3, 3, N) rotation of the end effector in the base frame
    p: Any  # (3, N) [m] its origin
    values: Any  # (m, N) of the redundancy

    def rows(self, rows: Any) -> "BatchGoal":
        """The goals of some rows."""
        return BatchGoal(self.R[:, :, rows], self.p[:, rows], self.values[:, rows])


@dataclass(frozen=True, eq=False)
class BatchSearch:
    """Newton's steps for the goals of one arm and one redundancy."""

    arm: Arm
    chain: Chain
    ee: Mounted
    redundancy: Redundancy | None
    damped: bool

    def run(self, goal: BatchGoal, seeds: Any, far: float) -> tuple[Any, Any]:
        """Solve what can be solved without a program.

        Args:
            goal: N goals.
            seeds: (N, n) [rad] within the limits, held joints at their values.
            far: [rad] solutions farther from their seed than this are not taken.

        Returns:
            Joint angles (N, n) [rad], and a mask (N,) of the rows that are solved.
        """
        xp = array_api.array_namespace(seeds)
        q = xp.asarray(seeds, copy=True)
        solved = xp.zeros((len(q),), dtype=xp.bool, device=array_api.device(q))
        rows = xp.arange(len(q), device=array_api.device(q))
        at, before = q, xp.full((len(q),), xp.inf, dtype=q.dtype, device=array_api.device(q))
        for _ in range(MAX_STEPS):
            error, derivative, angle = self.linearise(goal, self.chain.walk(at))
            size = xp.sqrt(xp.sum(error * error, axis=0))
            done = size <= LAST
            if xp.any(done):
                ended = rows[done]
                step, clear = self._last(error[:, done], derivative[:, :, done])
                q[ended] = self.moved(at[done], step)
                near = xp.max(xp.abs(q[ended] - seeds[ended]), axis=1) <= far
                solved[ended] = clear & near & inside_limits(self.arm, q[ended])
            going = ~done & (angle < STRAIGHT) & (size <= before)  # one that overshot is left to the single solver
            at, error, derivative, size = at[going], error[:, going], derivative[:, :, going], size[going]
            goal, rows = goal.rows(going), rows[going]
            if not len(rows):
                break
            damping = (DAMPING_GROWTH * size**2 if self.damped else 0.0 * size) + MIN_DAMPING
            step = self.step(error, derivative, damping)
            longest = xp.max(xp.abs(step), axis=0)
            step = step * xp.where(longest > MAX_STEP, MAX_STEP / longest, 1.0)
            at, before = self.moved(at, step), size
            inside = inside_limits(self.arm, at)
            at, before, goal, rows = at[inside], before[inside], goal.rows(inside), rows[inside]
        return q, solved

    def linearise(self, goal: BatchGoal, walk: Walk) -> tuple[Any, Any, Any]:
        """What is left to the goals.

        Returns:
            The error (k, N) of pose and redundancy, its derivative (k, free joints, N), and the angle (N,) [rad] to
            the goal's rotation.
        """
        xp = array_api.array_namespace(walk.q)
        R, p = walk.pose(self.ee)
        turn, angle = _rotation_vector(goal.R, R, xp)
        error = xp.concat([goal.p - p, turn], axis=0)
        if self.redundancy is None or self.redundancy.held:
            return error, self._by_free(walk), angle
        values, scale, slope = self.redundancy.linearise_batch(walk)
        change = scale * self.redundancy.difference(values, goal.values)
        return xp.concat([error, change], axis=0), self._by_free(walk, slope), angle

    def derivative(self, walk: Walk) -> Any:
        """Derivative (k, free joints, N) of the pose and the scaled redundancy."""
        if self.redundancy is None or self.redundancy.held:
            return self._by_free(walk)
        return self._by_free(walk, self.redundancy.linearise_batch(walk)[2])

    def _by_free(self, walk: Walk, *more: Any) -> Any:
        """Rows of the pose's derivative and of others (., n, N), by the free joints."""
        xp = array_api.array_namespace(walk.q)
        return xp.concat([walk.jacobian(self.ee), *more], axis=0)[:, self._free, :]

    def step(self, error: Any, derivative: Any, damping: Any) -> Any:
        """The change dq (free joints, N) that minimises ``|J dq - e|^2 + damping |dq|^2``."""
        xp = array_api.array_namespace(error)
        square, Jt = _square(derivative, damping, xp)
        solution = xp.linalg.solve(square, xp.permute_dims(error, (1, 0))[..., None])
        return xp.permute_dims(xp.matmul(Jt, solution)[..., 0], (1, 0))

    def moved(self, q: Any, step: Any) -> Any:
        """Joint angles (N, n) after a change of the free joints (free joints, N)."""
        xp = array_api.array_namespace(q)
        columns, changes = list(q.T), iter(step)
        for joint in self._free:
            columns[joint] = columns[joint] + next(changes)
        return xp.stack(columns, axis=1)

    def last_step(self, goal: BatchGoal, q: Any) -> Any:
        """One more step from solutions q (N, n) [rad], which follows changes of the goals (for automatic derivatives).

        Its derivative by the goal is that of the solution, by the implicit function theorem; in task space, whose
        solutions are not isolated, that of the smallest change of the joints.
        """
        columns = list(q.T)
        for joint, value in zip(self._held, goal.values, strict=False):
            columns[joint] = value
        at = array_api.array_namespace(q).stack(columns, axis=1)
        error, derivative, _ = self.linearise(goal, self.chain.walk(at))
        return self.moved(at, self.step(error, derivative, constant(np.full(len(q), MIN_DAMPING), q)))

    def _last(self, error: Any, derivative: Any) -> tuple[Any, Any]:
        """The step (free joints, N) that ends the search, and a mask (N,) of those far from a singularity.

        The smallest singular value is no smaller than one over the Frobenius norm of the inverse, which costs less
        and settles most.
        """
        xp = array_api.array_namespace(error)
        square, Jt = _square(derivative, constant(np.full(error.shape[1], LEAST), error), xp)
        inverse = xp.linalg.inv(square)
        step = xp.matmul(Jt, xp.matmul(inverse, xp.permute_dims(error, (1, 0))[..., None]))[..., 0]
        clear = xp.linalg.trace(inverse) < FOLD**-2
        doubtful = xp.nonzero(~clear)[0]
        J = xp.permute_dims(derivative[:, :, doubtful], (2, 0, 1))
        clear[doubtful] = xp.linalg.svdvals(J)[:, -1] > FOLD
        return xp.permute_dims(step, (1, 0)), clear

    @property
    def _held(self) -> tuple[int, ...]:
        return () if self.redundancy is None else self.redundancy.held

    @property
    def _free(self) -> list[int]:
        return [joint for joint in range(self.arm.dof) if joint not in self._held]


def inside_limits(arm: Arm, q: Any) -> Any:
    """Mask (N,) of the joint angles (N, n) [rad] within an arm's limits."""
    xp = array_api.array_namespace(q)
    return xp.all((q >= constant(arm.lower, q)) & (q <= constant(arm.upper, q)), axis=1)


def _square(derivative: Any, damping: Any, xp: Any) -> tuple[Any, Any]:
    """``J J^T + damping`` (N, k, k) and ``J^T`` (N, free joints, k) of derivatives (k, free joints, N)."""
    J, Jt = xp.permute_dims(derivative, (2, 0, 1)), xp.permute_dims(derivative, (2, 1, 0))
    return xp.matmul(J, Jt) + damping[:, None, None] * constant(np.eye(len(derivative)), derivative), Jt


def _rotation_vector(goal: Any, R: Any, xp: Any) -> tuple[Any, Any]:
    """Rotation vectors (3, N) [rad] in the base frame that turn R to a goal, and their lengths (N,)."""
    turn = [[sum(goal[i, k] * R[j, k] for k in range(3)) for j in range(3)] for i in range(3)]
    sine = xp.stack([turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]], axis=0) / 2.0
    cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1.0) / 2.0
    squared = xp.sum(sine * sine, axis=0)
    tiny = squared < 1e-24
    length = xp.sqrt(xp.where(tiny, 1.0, squared))  # finite slopes at zero, too
    angle = xp.atan2(length, cosine)
    return sine * xp.where(tiny, 1.0, angle / length), xp.where(tiny & (cosine > 0.0), 0.0, angle)
