"""Where the arm goes if only the pose is followed: recorded poses, decoded in task space one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.pose import TASK
from er_il.spaces.registry import make_arm_space

Array = NDArray[np.float64]

NEAREST, HOME, MEAN = "task-nearest", "task-posture", "task-mean"
DECODERS = (NEAREST, HOME, MEAN)


@dataclass(frozen=True, eq=False)
class TaskDrift:
    """What one decoder of task space makes of episodes, each of T steps."""

    decoder: str
    paths: tuple[Array, ...]  # (T, n) [rad] decoded
    elbow: tuple[Vector, ...]  # (T,) [m] distance of the arm from the recorded one, where it is largest
    joints: tuple[Vector, ...]  # (T,) [rad] of the worst joint
    followed: float  # share of the steps whose pose was met


def task_drift(arm: Arm, decoder: str, paths: Sequence[Array]) -> TaskDrift:
    """Decode the poses of recorded episodes open loop: each step starts at the joints of the step before.

    The end effector is where it was, so what differs is the elbow, and what hangs on it.

    Args:
        arm: The arm.
        decoder: One of ``DECODERS``: the solution nearest the last one; the null space pulled to the arm's home
            posture, or to the mean of the recorded joints.
        paths: Recorded joints, each (T, n) [rad] in time order. The first are where decoding starts.
    """
    postures = {HOME: arm.home, MEAN: np.concatenate(paths).mean(axis=0)}
    space = make_arm_space(TASK, arm, posture=postures.get(decoder))
    actions = [space.encode(path) for path in paths]
    decoded = [path.copy() for path in paths]
    met = []
    for t in range(1, max(map(len, paths))):  # all episodes at once, a step after the other
        going = [i for i, path in enumerate(paths) if len(path) > t]
        found = space.decode_batch(
            np.array([actions[i][t] for i in going]), np.array([decoded[i][t - 1] for i in going])
        )
        met += (found.status == Status.OK).tolist()
        for i, q in zip(going, found.q, strict=True):
            decoded[i][t] = q
    points = [(arm_points(arm, path), arm_points(arm, other)) for path, other in zip(paths, decoded, strict=True)]
    return TaskDrift(
        decoder,
        tuple(decoded),
        tuple(np.linalg.norm(here - there, axis=2).max(axis=1) for here, there in points),
        tuple(np.abs(path - other).max(axis=1) for path, other in zip(paths, decoded, strict=True)),
        float(np.mean(met)) if met else 1.0,
    )


def arm_points(arm: Arm, q: Array) -> Array:
    """Origins (N, n + 1, 3) [m] of the joints, base first, and of the end effector, at q (N, n) [rad]."""
    kinematics = kinematics_of(arm)
    joints = [arm.joints[index] for index in kinematics.chain.order]
    return np.stack([np.stack(point, axis=-1) for point in kinematics.positions(q, [*joints, arm.ee_frame])], axis=1)
