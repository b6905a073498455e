"""Joint angles of an arm over an episode."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointPath:
    """One episode of one arm, T steps."""

    episode: int
    commanded: Array  # (T, n) [rad]
    measured: Array  # (T, n) [rad] what was commanded the step before, where nothing was measured


@dataclass(frozen=True, eq=False)
class ArmPaths:
    """All episodes of one arm."""

    label: str  # "" where there is but one arm
    arm: Arm
    paths: tuple[JointPath, ...]
