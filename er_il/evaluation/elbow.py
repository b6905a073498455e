"""The elbow of a rollout against the elbows of the demonstrations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from er_il.arms.arm import Arm
from er_il.kinematics.solver import kinematics_of

Array = NDArray[np.float64]

# [m/s] What a second of another time counts for, when the demonstrated state is looked for that a rollout is
# nearest to: little beside the way of the hand, but where the hand stands still and the elbow moves, or where it
# comes back the way it went, only time tells the states apart.
TIME_WEIGHT = 0.02


@dataclass(frozen=True)
class ElbowReference:
    """Elbow positions of demonstrations, indexed by end-effector position and time."""

    arm: Arm
    elbow: str  # link of the elbow
    period: float  # [s] of a control step
    states: KDTree  # of (hand position [m], time as a length [m]), (N, 4)
    elbows: Array  # (N, 3) [m]

    @classmethod
    def of_demos(cls, arm: Arm, period: float, demos: Sequence[Array]) -> "ElbowReference | None":
        """Take the elbow along the joint paths (T, n) [rad] of demonstrations; None if the arm names no elbow."""
        if arm.angle_frames is None:
            return None
        elbow = arm.angle_frames.elbow
        states = np.concatenate([_states(arm, path, period) for path in demos])
        return cls(arm, elbow, period, KDTree(states), _positions(arm, np.concatenate(demos), elbow))

    def error(self, path: Array) -> float:
        """Mean distance [m] of the elbow along a joint path (T, n) [rad] from where the demonstrations had it.

        The demonstrated state of a step is the one that is nearest in hand position and time.
        """
        _, nearest = self.states.query(_states(self.arm, path, self.period))
        gaps = _positions(self.arm, path, self.elbow) - self.elbows[nearest]
        return float(np.linalg.norm(gaps, axis=1).mean())


def _states(arm: Arm, path: Array, period: float) -> Array:
    hand = _positions(arm, path, arm.ee_frame)
    return np.column_stack([hand, TIME_WEIGHT * period * np.arange(len(path), dtype=np.float64)])


def _positions(arm: Arm, path: Array, frame: str) -> Array:
    return kinematics_of(arm).fk_batch(path, frame)[:, :3, 3]
