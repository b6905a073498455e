"""Disturbances of the follower while it is demonstrated to: demonstrations then show how to come back.

A scripted leader goes a clean way, and a policy that has left it by millimetres is where no demonstration
ever was. So the follower is pushed off the way at random, while the action that is recorded stays the
leader's: it leads back (Laskey et al., DART: Noise Injection for Robust Imitation Learning, CoRL 2017).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

CORRELATION = 0.3  # [s] for which a push lasts
CALM_BEFORE, CALM_AFTER = 0.2, 1.0  # [s] around a movement of the gripper: a push would tip what it grasps
FADE = 0.5  # [s] in which pushes die down, and come back
MOVES = 0.01  # change of the gripper's opening in a step that is a movement

Floats = NDArray[np.float64]


def disturbances(
    script: Floats, grippers: Sequence[int], deviation: float, period: float, rng: np.random.Generator
) -> Floats:
    """Draw pushes (T, D) [rad] to add to the joint targets of a script (T, D); those of grippers are zero.

    Args:
        script: The leader's joint positions [rad] and gripper openings at each control step.
        grippers: Columns of the openings.
        deviation: Standard deviation [rad] of a joint's push (an Ornstein-Uhlenbeck process).
        period: Time [s] of a control step.
        rng: Source of randomness.
    """
    from scipy.signal import lfilter  # takes a second, of every command that knows recipes

    steps, joints = script.shape[0], np.delete(np.arange(script.shape[1]), grippers)
    keep = np.exp(-period / CORRELATION)
    pushes = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal((steps, len(joints))), axis=0)
    time = period * np.arange(steps)
    strength = np.ones(steps)
    for moved in time[np.flatnonzero((np.abs(np.diff(script[:, grippers], axis=0)) > MOVES).any(axis=1))]:
        away = np.where(time < moved, moved - time - CALM_BEFORE, time - moved - CALM_AFTER)  # [s] from the calm
        strength = np.minimum(strength, np.clip(away / FADE, 0.0, 1.0))
    found = np.zeros(script.shape)
    found[:, joints] = deviation * strength[:, None] * pushes
    return found
