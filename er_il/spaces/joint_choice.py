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
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.redundancy import JointAngle, Redundancy
from er_il.kinematics.self_motion import self_motions
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import ERJ, make_arm_space
from er_il.spaces.round_trip import SINGULAR, round_trips_of
from er_il.support.errors import ArmError
from er_il.support.series import stretches

Choice = tuple[str, ...]  # the n-6 joints that ERJ commands

LENGTH = 1.0  # [m] that weighs as much as 1 rad
FLIP = 0.3  # [rad] joints this far from those that were meant are another branch's
SEED_ERROR = 0.1  # [rad] of each joint, in round trips
POSITION_ERROR, ANGLE_ERROR = 2e-3, 6e-3  # [m, rad] standard deviations of a policy's actions, in playback
ROUND_TRIPS = 200  # of a choice, over the workspace and along demos


class Sensitivity(NamedTuple):
    """What a choice leaves to IK at N configurations."""

    smallest: Vector  # (N,) smallest singular value of J_-S
    condition: Vector  # (N,) largest by smallest
    self_motion: Vector  # (N,) |det N_S| with the sign of det J_-S, which changes at folds


@dataclass(frozen=True)
class SingularInterval:
    """Consecutive frames of an episode near a singularity."""

    first: int
    last: int
    smallest: float  # smallest singular value, metres and radians mixed


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


def sensitivity(redundancy: Redundancy, q: Array) -> Sensitivity:
    """What a redundancy leaves to IK at configurations q (N, n) [rad]."""
    kinematics = kinematics_of(redundancy.arm)
    jacobians = kinematics.jacobians(q)  # (N, 6, n)
    jacobians[:, :3] /= LENGTH
    derivative = redundancy.linearise_batch(kinematics.chain.walk(q))[2].transpose(2, 0, 1)  # (N, m, n)
    left = jacobians if redundancy.held else np.concatenate([jacobians, derivative], axis=1)
    left = np.delete(left, list(redundancy.held), axis=2)
    values = np.asarray(np.linalg.svd(left, compute_uv=False), dtype=np.float64)
    share = np.abs(np.linalg.det(self_motions(redundancy.arm, q) @ derivative.transpose(0, 2, 1)))
    smallest = values[:, -1]
    return Sensitivity(smallest, values[:, 0] / np.maximum(smallest, 1e-12), np.sign(np.linalg.det(left)) * share)


def singular_intervals(smallest: Vector) -> list[SingularInterval]:
    """Intervals of a path near a singularity, by its smallest singular values (T,)."""
    return [
        SingularInterval(first, last, float(smallest[first : last + 1].min()))
        for first, last in stretches(smallest < SINGULAR)
    ]


def crossings(self_motion: Vector) -> int:
    """Number of folds that a path (T,) crosses."""
    return int(np.count_nonzero(np.diff(np.sign(self_motion))))


def over_workspace(arm: Arm, choice: Choice, q: Array) -> Fitness:
    """Measure a choice over configurations q (N, n) [rad] within the limits, in no order.

    ``risk`` is the share near a singularity.
    """
    found = sensitivity(JointAngle(arm, choice), q)
    return _fitness(arm, choice, q, found, found.smallest < SINGULAR)


def along_demos(arm: Arm, choice: Choice, demos: Sequence[Array]) -> Fitness:
    """Measure a choice along demos, each (T, n) [rad] in time order.

    A demo is played back as a policy would that has learnt it: its actions with small errors, each
    decoded from where the last one led. ``risk`` is the share of steps near a singularity, or on
    another branch in playback.
    """
    space, q = _space(arm, choice), np.concatenate(demos)
    found = sensitivity(JointAngle(arm, choice), q)
    ends = np.cumsum([len(demo) for demo in demos])[:-1]
    off = off_branch(space, demos)
    risky = np.concatenate(off) | (found.smallest < SINGULAR)
    return replace(
        _fitness(arm, choice, q, found, risky),
        folds=float(np.mean([crossings(each) for each in np.split(found.self_motion, ends)])),
        off=float(np.concatenate(off).mean()),
        flips=flips(off),
    )


def off_branch(space: PoseSpace, demos: Sequence[Array]) -> list[NDArray[np.bool_]]:
    """The steps (T,) of each demo whose joints are on another branch in playback."""
    return [play_back(space, demo, np.random.default_rng(i)) > FLIP for i, demo in enumerate(demos)]


def flips(off: Sequence[NDArray[np.bool_]]) -> float:
    """Changes of branch in a demo's playback, on average, by the steps (T,) of each that are on another branch."""
    return float(np.mean([np.count_nonzero(np.diff(each)) for each in off]))


def play_back(space: PoseSpace, demo: Array, rng: np.random.Generator) -> Vector:
    """How far (T,) [rad] the worst joint is from a demo's (T, n), whose actions are decoded in turn, with errors."""
    q, values, distances = demo[0], space.redundancy_along(demo), []
    for T_base_ee, value, meant in zip(space.kinematics.fk_batch(demo), values, demo, strict=True):
        T_base_ee[:3, 3] += rng.normal(scale=POSITION_ERROR, size=3)
        T_base_ee[:3, :3] = Rotation.from_rotvec(rng.normal(scale=ANGLE_ERROR, size=3)).as_matrix() @ T_base_ee[:3, :3]
        q = space.solve(T_base_ee, value + rng.normal(scale=ANGLE_ERROR, size=len(value)), q).q
        distances.append(float(np.abs(q - meant).max()))
    return np.array(distances)


def ranked(sets: Sequence[Sequence[Fitness]]) -> list[Choice]:
    """Choices from the best to the worst: by their mean risk over sets of configurations, then by singular values.

    Each set has the fitness of the same choices in the same order.
    """

    def key(of_choice: Sequence[Fitness]) -> tuple[float, float]:
        risks, smallest = [each.risk for each in of_choice], [each.smallest_p50 for each in of_choice]
        return float(np.mean(risks)), -float(np.mean(smallest))

    return [of_choice[0].joints for of_choice in sorted(zip(*sets, strict=True), key=key)]


def _space(arm: Arm, choice: Choice) -> PoseSpace:
    space = make_arm_space(ERJ, arm.commanding(choice))
    assert isinstance(space, PoseSpace)
    return space


def _fitness(arm: Arm, choice: Choice, q: Array, sensitivity: Sensitivity, risky: NDArray[np.bool_]) -> Fitness:
    """What is measured over the workspace and along demos alike; ``risky`` (N,) marks what counts as risk."""
    space = _space(arm, choice)
    rows = np.unique(np.linspace(0, len(q) - 1, ROUND_TRIPS).astype(int))
    errors = np.random.default_rng(0).uniform(-SEED_ERROR, SEED_ERROR, (len(rows), arm.dof))
    missed = [trip for trip in round_trips_of(space, q[rows], errors) if not trip.exact]
    low, middle = np.percentile(sensitivity.smallest, [5, 50]).tolist()
    return Fitness(
        joints=choice,
        configurations=len(q),
        smallest_p05=low,
        smallest_p50=middle,
        condition_p50=float(np.median(sensitivity.condition)),
        self_motion=float(np.abs(sensitivity.self_motion).mean()),
        near_singular=float((sensitivity.smallest < SINGULAR).mean()),
        missed=len(missed) / len(rows),
        flipped=sum(trip.status is Status.OK for trip in missed) / len(rows),
        risk=float(risky.mean()),
    )
