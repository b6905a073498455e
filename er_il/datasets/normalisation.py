"""Scales by which policies see the world and are corrected: fit to what matters, not to what moves most."""

from pathlib import Path

import numpy as np
from lerobot.datasets import write_stats
from lerobot.datasets.io_utils import load_info, load_stats

from er_il.datasets.rewriting import episode_slices, read_episode_numbers, read_vectors
from er_il.datasets.schema import ENVIRONMENT_STATE, STATE, dimension_names
from er_il.kinematics.rotation import Quaternion, Rot6d
from er_il.spaces.spec import ACTION

MARGIN = 0.025  # [m], or of a quaternion's component (2.9 degrees), around where objects start
LEAST_DEVIATION = 0.02  # [rad], [m], or of a quaternion's component, of the robot's state
LEAST_ROTATION = 0.05  # of a component of an action's rotation (a quaternion's: 5.7 degrees)


def set_scales(root: Path) -> None:
    """Set the statistics by which ``configs/`` normalise what a policy sees.

    Object poses are scaled to a range. It becomes that of the episodes' starts, and a margin. The range of
    whole episodes would not do: an object that is carried across the scene has a large one, in which the
    centimetre by which its place differs from start to start is too little to see; an object that nobody
    moves trembles by less than a micrometre, and scaled by that, a graze would drown all else.

    The robot's state is scaled by its standard deviation. It becomes at least ``LEAST_DEVIATION``: where the
    hand keeps its orientation, millimetres of tracking error would become many deviations.

    Args:
        root: Folder of the dataset; its episodes' own statistics stay what they were.
    """
    stats = load_stats(root) or {}
    poses = read_vectors(root, ENVIRONMENT_STATE)
    starts = poses[[episode.start for episode in episode_slices(read_episode_numbers(root))]].astype(np.float64)
    stats[ENVIRONMENT_STATE] |= {"min": starts.min(axis=0) - MARGIN, "max": starts.max(axis=0) + MARGIN}
    stats[STATE] |= {"std": np.maximum(stats[STATE]["std"], LEAST_DEVIATION)}
    write_stats(stats, root)


def loosen_rotations(root: Path) -> None:
    """Set the statistics by which ``configs/`` normalise the rotations in what a policy does.

    Actions are scaled by their standard deviation, and a policy's errors count by it. Where the hand keeps its
    orientation to half a degree, four of ERJ's nine numbers would be held to a fraction of that, at the cost of where
    the hand goes. It becomes at least ``LEAST_ROTATION``.

    Args:
        root: Folder of the dataset; its episodes' own statistics stay what they were.
    """
    stats = load_stats(root) or {}
    names = dimension_names(load_info(root).features[ACTION])
    rotations = np.array([name.endswith((*Quaternion.names, *Rot6d.names)) for name in names])  # of any arm
    stats[ACTION] |= {"std": np.maximum(stats[ACTION]["std"], LEAST_ROTATION * rotations)}
    write_stats(stats, root)
