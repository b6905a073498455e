"""Telling changes (deltas) from angles: both are small numbers, but few arms stay where all their joints are zero."""

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.sanity_checks import OUTSIDE_TOLERANCE, share_outside
from er_il.spaces.base import Array

CENTRED = 0.25  # [rad] a joint whose median is this close to zero is where changes are, too
APART = 0.5  # of the measured angles: changes are this far from them, on average
FAR = 0.2  # [rad] and this far at least


def stays_around_zero(q: Array) -> bool:
    """True if angles (N, n) [rad] have their medians at zero, all but one: that may be a gripper, open or closed."""
    return bool(np.count_nonzero(np.abs(np.median(q, axis=0)) < CENTRED) >= q.shape[1] - 1)


def are_changes(arm: Arm, q: Array, measured: Array | None) -> bool:
    """True if what was taken for joint angles must be changes: of the joints, or of an end effector and a gripper.

    They stay around zero, though the joints were measured to be elsewhere at that time, or cannot all be zero, as a
    Panda's fourth.

    Args:
        arm: The arm.
        q: (N, n) [rad] what the angles would be.
        measured: (N, n) [rad] at the same times; None where nothing was measured.
    """
    if not stays_around_zero(q):
        return False
    if measured is None:
        return share_outside(arm, q) > OUTSIDE_TOLERANCE
    return bool(np.abs(q - measured).mean() > max(FAR, APART * np.abs(measured).mean()))
