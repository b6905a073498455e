"""Statistics by which policies normalise observations and actions, bounded so that noise is not amplified."""

from pathlib import Path

import numpy as np
from lerobot.datasets import write_stats
from lerobot.datasets.compute_stats import compute_episode_stats
from lerobot.datasets.io_utils import load_stats

from er_il.datasets.dataset import Dataset
from er_il.datasets.rewriting import replace_statistics
from er_il.datasets.schema import ENVIRONMENT_STATE, STATE
from er_il.kinematics.rotation import Quaternion, Rot6d, Rot6dRows
from er_il.spaces.relative import RelativeActions, relative_samples
from er_il.spaces.spec import ACTION

Stats = dict[str, dict[str, np.ndarray]]

MARGIN = 0.025  # [m], or of a quaternion's component (2.9 degrees), around where objects start
LEAST_DEVIATION = 0.02  # [rad], [m], or of a quaternion's component, of the robot's state
HIDING = 1e6  # [rad]
LEAST_ROTATION = 0.05  # of a component of an action's rotation (a quaternion's: 5.7 degrees)


def normalise_observations(root: Path) -> None:
    """Set the statistics by which ``configs/`` normalise object poses and the robot's state.

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
    dataset = Dataset(root)
    poses = dataset.vectors(ENVIRONMENT_STATE)
    starts = poses[[rows.start for rows in dataset.episodes.values()]].astype(np.float64)
    stats[ENVIRONMENT_STATE] |= {"min": starts.min(axis=0) - MARGIN, "max": starts.max(axis=0) + MARGIN}
    stats[STATE] |= {"std": np.maximum(stats[STATE]["std"], LEAST_DEVIATION)}
    _write(stats, root)


def hide_joints(root: Path) -> None:
    """Set the statistics such that policies of ``configs/`` do not see the arm's joints, but the hand as ever.

    A joint angle is scaled by a deviation in which it is next to nothing.

    Args:
        root: Folder of the dataset; its episodes' own statistics stay what they were.
    """
    stats = load_stats(root) or {}
    dataset = Dataset(root)
    joints = {name for part in dataset.layout.parts for name in part.motors.state or part.motors.joints}
    hidden = np.array([name in joints for name in dataset.names(STATE)])
    stats[STATE] |= {"std": np.where(hidden, HIDING, stats[STATE]["std"])}
    _write(stats, root)


def normalise_actions(root: Path) -> None:
    """Set the statistics by which policies normalise actions: of chunk-relative ones, those of what policies see.

    These are over all actions of all chunks (:func:`er_il.spaces.relative.relative_samples`), of each episode and of
    all, so that LeRobot's edits of the dataset keep them. Rotations are then bounded, see below.

    Args:
        root: Folder of the dataset.

    Raises:
        ErIlError: the state does not measure the joints that chunk-relative actions count from.
    """
    dataset = Dataset(root)
    if dataset.layout.chunk:
        convert = RelativeActions(dataset.layout, dataset.names(STATE))
        actions, states = dataset.vectors(ACTION), dataset.vectors(STATE)
        samples = {
            number: relative_samples(convert, actions[rows], states[rows]).astype(np.float32)
            for number, rows in dataset.episodes.items()
        }
        features = dataset.features
        replace_statistics(
            root, {key: compute_episode_stats({ACTION: each}, features) for key, each in samples.items()}
        )
    bound_rotation_deviation(root)


def bound_rotation_deviation(root: Path) -> None:
    """Set a lower bound on the standard deviation by which ``configs/`` normalise the rotations of actions.

    Actions are scaled by their standard deviation, and a policy's errors count by it. Where the hand keeps its
    orientation to half a degree, four of ERJ's nine numbers would be held to a fraction of that, at the cost of where
    the hand goes. It becomes at least ``LEAST_ROTATION``.

    Args:
        root: Folder of the dataset; its episodes' own statistics stay what they were.
    """
    stats = load_stats(root) or {}
    names = Dataset(root).names(ACTION)
    rotations = np.array(
        [name.endswith((*Quaternion.names, *Rot6d.names, *Rot6dRows.names)) for name in names]
    )  # of any arm
    stats[ACTION] |= {"std": np.maximum(stats[ACTION]["std"], LEAST_ROTATION * rotations)}
    _write(stats, root)


def _write(stats: Stats, root: Path) -> None:
    """Write statistics in alphabetical order: LeRobot's own order differs from run to run."""
    write_stats({feature: dict(sorted(stats[feature].items())) for feature in sorted(stats)}, root)
