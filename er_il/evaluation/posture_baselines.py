"""Posture baselines: task space with its null space pulled to one posture of the demonstrations.

A pose leaves the elbow open, and a controller that pulls it to a fixed posture closes the gap. If there
is one posture that suits a whole task, that is enough, and no redundancy-aware action is needed.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from er_il.envs.decoders import decoder

Array = NDArray[np.float64]

CLOSED = 0.5  # opening below which the gripper counts as closed


def mean_posture(demos: Sequence[Array]) -> Array:
    """Mean of all joint angles (n,) [rad] in demonstrations (T, n + 1): angles, then the gripper's opening."""
    return np.concatenate(demos)[:, :-1].mean(axis=0)


def grasp_posture(demos: Sequence[Array]) -> Array:
    """Mean over demonstrations of the joint angles (n,) [rad] at the moment that matters.

    That is when the gripper closes for the last time; where it never closes, the end, which is the press of a
    button.
    """
    return np.mean([demo[_last_closing(demo[:, -1]), :-1] for demo in demos], axis=0)


POSTURE_BASELINES: Mapping[str, Callable[[Sequence[Array]], Array]] = {
    "task-mean": mean_posture,
    "task-grasp": grasp_posture,
}

# Decoders that bring the elbow where no demonstration had it. Their policies are trained not to see the joints: others
# observe what they were never shown, and are lost even on a task on which any elbow will do.
UNSEEN_ELBOW = ("task-clear",)

POSTURE_DECODER = "task-posture"  # what a posture baseline is, but for the posture


def space_of(decoder_name: str) -> str:
    """Name of the action space that a decoder, or a posture baseline, reads.

    Raises:
        UnknownNameError: no decoder has that name.
    """
    return decoder(POSTURE_DECODER if decoder_name in POSTURE_BASELINES else decoder_name).space


def _last_closing(opening: Array) -> int:
    closed = opening < CLOSED
    closings = np.flatnonzero(closed[1:] & ~closed[:-1]) + 1
    return int(closings[-1]) if len(closings) else len(opening) - 1
