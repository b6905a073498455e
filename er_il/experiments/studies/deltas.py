"""The study of delta actions: the error that accumulates when a demonstration's deltas are decoded one by one."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Arm
from er_il.experiments.studies import Advance, Demos
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.base import Array
from er_il.spaces.delta import PREFIX, DeltaSpace
from er_il.spaces.registry import PLAIN, make_arm_space
from er_il.support.workers import run_jobs


def study_deltas(arm: Arm, demos: Demos, advance: Advance) -> dict[str, Any]:
    """Encode demonstrations as deltas and integrate them by decoding, in every space.

    Returns:
        JSON with a row of ``drifts`` per space: the ``steps`` of all demonstrations and of the ``longest``, the number
        of ``invalid`` decodes, and the largest error at any step of the ``joints`` [rad] and of the end effector's
        ``position`` [m] and ``rotation`` [rad].

    Raises:
        BoundsError: a demonstration moves faster than the bounds that delta spaces declare.
        ArmError: an ER space does not suit the arm.
    """
    paths = [path.commanded for of_set in demos.values() for path in of_set]
    return {"drifts": run_jobs([(_drift, make_arm_space(PREFIX + kind, arm), paths) for kind in PLAIN], 1, advance)}


def _drift(space: DeltaSpace, demos: Sequence[Array]) -> dict[str, Any]:
    """Integrate the deltas of demonstrations (T, n) [rad], each decoded from the last command as on a robot."""
    kinematics, invalid = kinematics_of(space.arm), 0
    errors = [(0.0, 0.0, 0.0)]  # of each step: joints [rad], position [m] and rotation [rad]
    for demo in demos:
        q, meant = demo[0], demo[1:]
        actions, poses = space.encode(meant, start=q), kinematics.fk_batch(meant)
        for wanted, T_base_ee, action in zip(meant, poses, actions, strict=True):
            decoded = space.decode(action, q, current=q)
            q, invalid = decoded.q, invalid + (decoded.status is not Status.OK)
            errors.append((np.abs(q - wanted).max(), *kinematics.pose_error(T_base_ee, q)))
    lengths = [len(demo) for demo in demos]
    found = {"space": space.absolute.kind, "steps": sum(lengths), "longest": max(lengths), "invalid": invalid}
    return found | dict(zip(("joints", "position", "rotation"), np.max(errors, axis=0).tolist(), strict=True))
