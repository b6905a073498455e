"""The script of Reach Target."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.reach_target import BALL, ReachTarget

PITCH = np.radians(80)  # of the hand below the horizontal
PACE = 0.5  # share of the script's speed: a faster hand overshoots the ball of a short way


class ReachTargetLeader(MovesLeader[ReachTarget]):
    """Any elbow will do."""

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        x, y, z = self._world.position(BALL)
        yaw = float(np.arctan2(y, x))
        return [Move([Keyframe(hand_pose(np.array([x, y, z]), PITCH, yaw), None, straight=True)], 1.0, PACE)]
