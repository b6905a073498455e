"""Ranges of what stands still: noise must not be scaled up to a motion."""

from pathlib import Path

import numpy as np
from lerobot.datasets import write_stats
from lerobot.datasets.io_utils import load_stats

from er_il.data.schema import ENVIRONMENT_STATE

LEAST_RANGE = 0.02  # [m], or of a quaternion's component (2.3 degrees)


def widen_ranges(root: Path) -> None:
    """Widen the objects' recorded minima and maxima about their middle to a least range.

    Policies see object poses scaled to the range they had (``configs/``). A thing that nobody moves
    trembles by less than a micrometre: scaled by that, a graze would drown all else.

    Args:
        root: Folder of the dataset; its episodes' own statistics stay what they were.
    """
    stats = load_stats(root) or {}
    poses = stats[ENVIRONMENT_STATE]
    middle, half = (poses["min"] + poses["max"]) / 2, (poses["max"] - poses["min"]) / 2
    still = half < LEAST_RANGE / 2
    poses["min"] = np.where(still, middle - LEAST_RANGE / 2, poses["min"])
    poses["max"] = np.where(still, middle + LEAST_RANGE / 2, poses["max"])
    write_stats(stats, root)
