"""How far demonstrations stay from the folds of an ER space, and how much of them is at risk."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from er_il.arms.arm import Arm, Weights
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.linear_coordinates import LinearCoordinates
from er_il.kinematics.self_motion import margins, self_motions
from er_il.spaces.base import Array
from er_il.spaces.joint_choice import crossings, flips, off_branch, sensitivity
from er_il.spaces.pose import PoseSpace
from er_il.spaces.round_trip import SINGULAR


@dataclass(frozen=True)
class DemoMargins:
    """Margins of a space (:func:`er_il.kinematics.self_motion.margins`) along demonstrations."""

    smallest: float
    demo: int  # where it is, counted from 0
    step: int
    p05: float
    p50: float
    folds: int  # that demonstrations cross, all together
    flips: float  # changes of branch in a demo's playback, on average
    off: float  # share of the steps of playback whose joints were on another branch than the demo's
    condition_p50: float  # largest by smallest singular value of what is left to IK, 1 m weighing as 1 rad
    condition_p95: float
    risk: float  # share of the steps near a singularity or off, as of :class:`er_il.spaces.joint_choice.Fitness`


def margins_along(space: PoseSpace, demos: Sequence[Array]) -> DemoMargins:
    """Measure a space with a redundancy along demonstrations, each (T, n) [rad] in time order."""
    assert space.redundancy is not None
    q, ends = np.concatenate(demos), np.cumsum([len(demo) for demo in demos])
    found, sensed = margins(space.redundancy, q), sensitivity(space.redundancy, q)
    by_demo = off_branch(space, demos)
    off = np.concatenate(by_demo)
    worst = int(found.argmin())
    demo = int(np.searchsorted(ends, worst, side="right"))
    low, middle = np.percentile(found, [5, 50]).tolist()
    typical, large = np.percentile(sensed.condition, [50, 95]).tolist()
    return DemoMargins(
        smallest=float(found[worst]),
        demo=demo,
        step=worst - int(ends[demo]) + len(demos[demo]),
        p05=low,
        p50=middle,
        folds=sum(map(crossings, np.split(sensed.self_motion, ends[:-1]))),
        flips=flips(by_demo),
        off=float(off.mean()),
        condition_p50=typical,
        condition_p95=large,
        risk=float((off | (sensed.smallest < SINGULAR)).mean()),
    )


def motion_measured(arm: Arm, weights: Weights) -> dict[str, Any]:
    """What ERX's coordinates W q measure at the arm's home, as JSON.

    Returns:
        ``cosine``: margin there, 1 if the coordinates measure the self-motion and nothing else. ``joints``: change
        (m, n) [rad] of the joints with one radian of each coordinate, the end effector still. ``elbow``: how far each
        of these turns the elbow about the line from shoulder to wrist [rad]; absent where the arm names none.
    """
    home, coordinates = arm.home[None], LinearCoordinates(arm, weights)
    N = self_motions(arm, home)[0]
    per_radian = np.linalg.solve(N @ coordinates.weights.T, N)
    measured: dict[str, Any] = {"cosine": float(margins(coordinates, home)[0]), "joints": per_radian.tolist()}
    if arm.redundancy == 1 and arm.angle_frames is not None:
        at = ArmAngle(arm).linearise(arm.home)
        measured["elbow"] = (per_radian @ at.derivative[0] / at.scale).tolist()
    return measured
