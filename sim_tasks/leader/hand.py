"""Poses of the leader's hand."""

import numpy as np

DOWN = np.radians(89.9)  # pitch of a hand that points straight down


def hand_pose(position: np.ndarray, pitch: float, yaw: float = 0.0) -> np.ndarray:
    """T_base_ee (4, 4) of a hand that points forward and down, the fingers level.

    Args:
        position: (3,) [m] of the end effector.
        pitch: Angle [rad] below the horizontal.
        yaw: Turn [rad] about the vertical.
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    approach = np.array([np.cos(pitch) * cos, np.cos(pitch) * sin, -np.sin(pitch)])
    level = np.array([sin, -cos, 0.0])  # the flange up, as the Panda carries its camera
    T = np.eye(4)
    T[:3, :3] = np.column_stack([np.cross(level, approach), level, approach])
    T[:3, 3] = position
    return T
