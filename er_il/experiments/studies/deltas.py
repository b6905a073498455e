"""The study of delta actions: the error that accumulates when a demonstration's deltas are decoded one by one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm
from er_il.datasets.joint_path import JointPath
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.delta import PREFIX, DeltaSpace
from er_il.spaces.registry import SPACES, make_arm_space
from er_il.support.workers import run_jobs

Array = NDArray[np.float64]


def study_deltas(
    arm: Arm, demos: Mapping[str, Sequence[JointPath]], advance: Callable[[int, int], object]
) -> dict[str, Any]:
    """Encode demonstrations as deltas and integrate them by decoding, in every space.

    Args:
        arm: The arm.
        demos: Its demonstrations.
        advance: Called with the number of spaces done, and their total.

    Returns:
        JSON with a row of ``drifts`` per space: the ``steps`` of all demonstrations and of the ``longest``, the number
        of ``invalid`` decodes, and the largest error at any step of the ``joints`` [rad] and of the end effector's
        ``position`` [m] and ``rotation`` [rad].

    Raises:
        BoundsError: a demonstration moves faster than the bounds that delta spaces declare.
        ArmError: an ER space does not suit the arm.
    """
    paths = [path.commanded for of_set in demos.values() for path in of_set]
    spaces = [make_arm_space(PREFIX + kind, arm) for kind in SPACES]
    return {"drifts": run_jobs([(_drift, space, paths) for space in spaces], 1, advance)}


def integrate(space: DeltaSpace, demo: Array) -> tuple[Array, int]:
    """Integrate a demonstration's deltas: joints (T, n) [rad], and the number of decodes that were not OK.

    Each is decoded from the last command, as on a robot that follows.
    """
    path, invalid = [demo[0]], 0
    for action in space.encode(demo[1:], start=demo[0]):
        decoded = space.decode(action, path[-1], current=path[-1])
        invalid += decoded.status is not Status.OK
        path.append(decoded.q)
    return np.array(path), invalid


def _drift(space: DeltaSpace, demos: Sequence[Array]) -> dict[str, Any]:
    kinematics, errors, invalid = kinematics_of(space.arm), [], 0
    for demo in demos:
        path, failed = integrate(space, demo)
        invalid += failed
        poses = [kinematics.pose_error(T, q) for T, q in zip(kinematics.fk_batch(demo), path, strict=True)]
        errors.append(np.column_stack([np.abs(path - demo).max(axis=1), poses]))
    lengths = [len(demo) for demo in demos]
    largest = np.concatenate(errors).max(axis=0).tolist()
    found = {"space": space.absolute.kind, "steps": sum(lengths), "longest": max(lengths), "invalid": invalid}
    return found | dict(zip(("joints", "position", "rotation"), largest, strict=True))
