"""Deviation of a path from the poses and arm angles that were asked for, and the limits that were in its way."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_il.kinematics.goal import POSITION_TOLERANCE, ROTATION_TOLERANCE
from er_il.kinematics.redundancy import Array

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Deviation:
    """How far a path of T frames is from what was asked for."""

    position: Array  # (T,) [m]
    rotation: Array  # (T,) [rad]
    arm_angle: Array  # (T,) [rad] 0 where no arm angle is kept
    at_limit: Flags  # (T, n) joints at a limit
    speed: Array  # (T, n) [1] of each joint to this frame, by its limit; 0 in the first

    @property
    def off_pose(self) -> Flags:
        """Mask (T,) of the frames whose pose is not reached."""
        return (self.position > POSITION_TOLERANCE) | (self.rotation > ROTATION_TOLERANCE)

    @property
    def off_elbow(self) -> Flags:
        """Mask (T,) of the frames whose pose is reached, with another arm angle."""
        return ~self.off_pose & (self.arm_angle > ROTATION_TOLERANCE)

    @property
    def too_fast(self) -> Flags:
        """Mask (T,) of the frames to which a joint moves faster than it can."""
        return np.any(self.speed > 1.0, axis=1)

    @property
    def missed(self) -> Flags:
        """Mask (T,) of the frames that are not reached exactly."""
        return self.off_pose | self.off_elbow
