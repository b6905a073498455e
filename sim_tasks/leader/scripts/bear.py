"""The script of Retrieve Bear."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.pick import PickLeader
from sim_tasks.tasks.retrieve_bear import RetrieveBear

GAP = 0.36  # x [m] at which the hand passes between vase and cactus, always at y = 0
PITCH = np.radians(45)  # of the hand below the horizontal
ABOVE_GAP = (0.38, 0.0, 0.66)  # [m] first via point, wherever the bear is
ABOVE = (-0.12, 0.0, 0.13)  # [m] second via point, from the grasp
LIFTED = (-0.02, 0.0, 0.15)  # [m] end, from the grasp
ELBOW_OUT, ELBOW_BETWEEN, ELBOW_UP = 1.2, 1.1, 0.3  # [rad] of the base joint


class RetrieveBearLeader(PickLeader[RetrieveBear]):
    """The elbow is out while the hand is drawn back, and comes up as the hand goes in between the clutter."""

    clearance = 0.012

    def __init__(self, world: RetrieveBear, *, speed_range: tuple[float, float] = (0.35, 0.42), **kwargs: Any) -> None:
        """Prepare to demonstrate in ``world``; see :class:`sim_tasks.leader.leader.Leader`."""
        super().__init__(world, speed_range=speed_range, **kwargs)

    def _obstacles(self) -> tuple[str, ...]:
        return (*super()._obstacles(), *self._world.clutter)

    def _keyframes(self, rng: np.random.Generator) -> tuple[list[Keyframe], list[Keyframe]]:
        grasp = self._world.object_pose(self._world.target)[:3] + np.array([0.0, 0.0, self._world.grasp_height])
        yaw = float(np.arctan2(grasp[1], grasp[0] - GAP))
        along = Rotation.from_euler("z", yaw)
        approach = [
            Keyframe(hand_pose(ABOVE_GAP + self._draw_via(rng), PITCH), ELBOW_OUT),
            Keyframe(hand_pose(grasp + along.apply(ABOVE), PITCH, yaw), ELBOW_BETWEEN, straight=True),
            Keyframe(hand_pose(grasp, PITCH, yaw), ELBOW_UP, straight=True),
        ]
        retreat = [Keyframe(hand_pose(grasp + along.apply(LIFTED), PITCH, yaw), ELBOW_UP, straight=True)]
        return approach, retreat
