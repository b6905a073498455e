"""The choice of the joints that ERJ commands: what each leaves to IK, by kinematics alone.

With the joints S commanded, IK has the others' square Jacobian J_-S. Its determinant is

    |det J_-S| = |det N_S| sqrt(det J J^T)

where the columns of N are an orthonormal basis of the arm's self-motion, the joint velocities that
leave the end effector still. So a choice is as good as self-motion turns its joints: where it does
not, det N_S = 0, two solutions meet (a fold), and past it the same action means the other one. For another redundancy
with the derivative D the same holds of det(D N).

Lengths weigh by ``LENGTH`` against angles in singular values; det N_S does without.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.redundancy import JointAngle, Redundancy
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import ERJ, make_arm_space
from er_il.spaces.round_trip import SINGULAR, round_trip
from er_il.support.errors import ArmError

Array = NDArray[np.float64]
Choice = tuple[str, ...]  # the n-6 joints that ERJ commands

LENGTH = 1.0  # [m] that weighs as much as 1 rad
FLIP = 0.3  # [rad] joints this far from those that were meant are another branch's
SEED_ERROR = 0.1  # [rad] of each joint, in round trips
POSITION_ERROR, ANGLE_ERROR = 2e-3, 6e-3  # [m, rad] standard deviations of a policy's actions, in playback
ROUND_TRIPS = 200  # of a choice, over the workspace and along demos


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """What a choice leaves to IK at N configurations."""

    smallest: Vector  # (N,) smallest singular value of J_-S
    condition: Vector  # (N,) largest by smallest
    self_motion: Vector  # (N,) |det N_S| with the sign of det J_-S, which changes at folds


@dataclass(frozen=True)
class Fitness:
    """How a choice does over a set of configurations."""

    joints: Choice
    configurations: int
    smallest_p05: float
    smallest_p50: float
    condition_p50: float
    self_motion: float  # mean |det N_S|
    near_singular: float  # share of configurations
    missed: float  # share of round trips that did not return the joints
    flipped: float  # share of round trips that met the action with other joints
    risk: float  # share near a singularity or lost: see ``over_workspace`` and ``along_demos``
    folds: float | None = None  # crossed by a demo, on average
    off: float | None = None  # share of the steps of playback whose joints were on another branch than the demo's
    flips: float | None = None  # changes of branch in a demo's playback, on average


def choices(arm: Arm) -> list[Choice]:
    """All sets of joints that ERJ could command.

    Raises:
        ArmError: the arm has no redundancy.
    """
    if arm.redundancy == 0:
        raise ArmError(
            f"{arm.name} has {arm.dof} joints and so no redundancy: no joint is left to command beside the pose. "
            "Use joint or task."
        )
    return list(itertools.combinations(arm.joints, arm.redundancy))


def sensitivities(arm: Arm, q: Array) -> dict[Choice, Sensitivity]:
    """What every choice leaves to IK at configurations q (N, n) [rad]."""
    jacobians = weighted_jacobians(arm, q)
    return {choice: sensitivity(JointAngle(arm, choice), jacobians, q) for choice in choices(arm)}


def weighted_jacobians(arm: Arm, q: Array) -> Array:
    """End-effector Jacobians (N, 6, n) at q (N, n) [rad], lengths weighed by ``LENGTH`` against angles."""
    kinematics = kinematics_of(arm)
    jacobians = np.array([kinematics.jacobian(each) for each in q])
    jacobians[:, :3] /= LENGTH
    return jacobians


def sensitivity(redundancy: Redundancy, jacobians: Array, q: Array) -> Sensitivity:
    """What a redundancy leaves to IK at configurations q (N, n) [rad] with weighted Jacobians (N, 6, n)."""
    derivative = np.array([redundancy.linearise(each).derivative for each in q])  # (N, m, n)
    left = jacobians if redundancy.held else np.concatenate([jacobians, derivative], axis=1)
    left = np.delete(left, list(redundancy.held), axis=2)
    values = np.asarray(np.linalg.svd(left, compute_uv=False), dtype=np.float64)
    basis = np.linalg.svd(jacobians)[2][:, -derivative.shape[1] :]  # (N, m, n) self-motion
    share = np.abs(np.linalg.det(basis @ derivative.transpose(0, 2, 1)))
    smallest = values[:, -1]
    return Sensitivity(smallest, values[:, 0] / np.maximum(smallest, 1e-12), np.sign(np.linalg.det(left)) * share)


def stretches(smallest: Vector) -> list[tuple[int, int, float]]:
    """First and last frame of each stretch (T,) near a singularity, and the smallest singular value in it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], smallest < SINGULAR, [False]]).astype(int)))
    ranges = zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    return [(first, stop - 1, float(smallest[first:stop].min())) for first, stop in ranges]


def crossings(self_motion: Vector) -> int:
    """Number of folds that a path (T,) crosses."""
    return int(np.count_nonzero(np.diff(np.sign(self_motion))))


def over_workspace(arm: Arm, choice: Choice, q: Array, sensitivity: Sensitivity) -> Fitness:
    """Measure a choice over configurations q (N, n) [rad] within the limits, in no order.

    ``risk`` is the share near a singularity.
    """
    missed, flipped = _round_trips(arm, choice, q)
    near = sensitivity.smallest < SINGULAR
    return Fitness(choice, len(q), *_summary(sensitivity), missed, flipped, float(near.mean()))


def along_demos(arm: Arm, choice: Choice, demos: Sequence[Array], sensitivity: Sequence[Sensitivity]) -> Fitness:
    """Measure a choice along demos, each (T, n) [rad] in time order, with the sensitivity along each.

    A demo is played back as a policy would that has learnt it: its actions with small errors, each
    decoded from where the last one led. ``risk`` is the share of steps near a singularity, or on
    another branch in playback.
    """
    space = _space(arm, choice)
    whole = Sensitivity(
        *(np.concatenate([getattr(each, part.name) for each in sensitivity]) for part in fields(Sensitivity))
    )
    off = [play_back(space, demo, np.random.default_rng(i)) > FLIP for i, demo in enumerate(demos)]
    risky = np.concatenate(off) | (whole.smallest < SINGULAR)
    missed, flipped = _round_trips(arm, choice, np.concatenate(demos))
    return Fitness(
        choice,
        len(risky),
        *_summary(whole),
        missed,
        flipped,
        float(risky.mean()),
        folds=float(np.mean([crossings(each.self_motion) for each in sensitivity])),
        off=float(np.concatenate(off).mean()),
        flips=float(np.mean([np.count_nonzero(np.diff(each)) for each in off])),
    )


def play_back(space: PoseSpace, demo: Array, rng: np.random.Generator) -> Vector:
    """How far (T,) [rad] the worst joint is from a demo's (T, n), whose actions are decoded in turn, with errors."""
    q, values, distances = demo[0], space.redundancy_along(demo), []
    for T_base_ee, value, meant in zip(space.kinematics.fk_batch(demo), values, demo, strict=True):
        T_base_ee[:3, 3] += rng.normal(scale=POSITION_ERROR, size=3)
        T_base_ee[:3, :3] = Rotation.from_rotvec(rng.normal(scale=ANGLE_ERROR, size=3)).as_matrix() @ T_base_ee[:3, :3]
        q = space.solve(T_base_ee, value + rng.normal(scale=ANGLE_ERROR, size=len(value)), q).q
        distances.append(float(np.abs(q - meant).max()))
    return np.array(distances)


def ranked(fitness: Sequence[Mapping[Choice, Fitness]]) -> list[Choice]:
    """Choices from the best to the worst: by their mean risk over sets of configurations, then by singular values."""

    def key(choice: Choice) -> tuple[float, float]:
        each = [of_set[choice] for of_set in fitness]
        return float(np.mean([one.risk for one in each])), -float(np.mean([one.smallest_p50 for one in each]))

    return sorted(fitness[0], key=key)


def _space(arm: Arm, choice: Choice) -> PoseSpace:
    space = make_arm_space(ERJ, arm.commanding(choice))
    assert isinstance(space, PoseSpace)
    return space


def _summary(sensitivity: Sensitivity) -> tuple[float, float, float, float, float]:
    low, middle = np.percentile(sensitivity.smallest, [5, 50]).tolist()
    return (
        low,
        middle,
        float(np.median(sensitivity.condition)),
        float(np.abs(sensitivity.self_motion).mean()),
        float((sensitivity.smallest < SINGULAR).mean()),
    )


def _round_trips(arm: Arm, choice: Choice, q: Array) -> tuple[float, float]:
    """Shares of round trips that missed the joints, and that met the action with other joints."""
    space, rng = _space(arm, choice), np.random.default_rng(0)
    rows = np.unique(np.linspace(0, len(q) - 1, ROUND_TRIPS).astype(int))
    missed = [trip for trip in (round_trip(space, q[row], SEED_ERROR, rng) for row in rows) if not trip.exact]
    return len(missed) / len(rows), sum(trip.decoded.status is Status.OK for trip in missed) / len(rows)
