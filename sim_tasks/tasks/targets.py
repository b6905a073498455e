"""Joint targets: what an action of a joint-level environment is, and what is none."""

from collections.abc import Mapping
from itertools import chain

import gymnasium as gym
import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.support.vectors import check_bounds, named_vector

OVERSHOOT = 2 * np.pi  # [rad] by which a target may lie beyond its limit, to be clipped; degrees lie farther


class JointTargets:
    """Targets (n+1,) of an arm's joints [rad] and the gripper's opening in [0, 1]; of several arms, in turn."""

    def __init__(self, arms: Mapping[str, Arm]) -> None:
        """Targets of arms by their labels."""
        lower = np.concatenate([np.append(arm.lower, 0.0) for arm in arms.values()])
        upper = np.concatenate([np.append(arm.upper, 1.0) for arm in arms.values()])
        self.space = gym.spaces.Box(lower.astype(np.float32), upper.astype(np.float32))
        self._names = tuple(
            chain(*((*arm.joints, f"{label}_gripper" if label else "gripper") for label, arm in arms.items()))
        )
        self._bounds = self.space.low.astype(np.float64), self.space.high.astype(np.float64)

    def checked(self, action: object) -> Vector:
        """An action, clipped to the limits.

        Raises:
            NumbersError: it holds no real numbers, or some not finite or more than ``OVERSHOOT`` beyond their limits.
            ShapeError: it has another shape.
        """
        targets = named_vector("The action", action, self._names)
        check_bounds("The action", targets, self._names, *self._bounds, slack=OVERSHOOT)
        return np.clip(targets, *self._bounds)
