"""The script that puts rubbish into a bin."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import DOWN, hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.put_rubbish_in_bin import BIN, HIGH, LOW, TOMATOES, PutRubbishInBin

ABOVE = np.array([0.0, 0.0, 0.10])  # [m] over the rubbish
SIDEWAYS = (0.35, 0.4)  # paces of reaching and carrying: the follower lags with the hand's speed


class PutRubbishInBinLeader(MovesLeader[PutRubbishInBin]):
    """From above, and over the bin's rim, the arm in the plane of its first joint; any elbow would do."""

    avoid = (BIN, *TOMATOES)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        rubbish, high, low = world.rubbish.copy(), world.above_rim(HIGH), world.above_rim(LOW)
        yaw, bin_yaw = (float(np.arctan2(point[1], point[0])) for point in (rubbish, high))

        def grasp(offset: np.ndarray, straight: bool = False) -> Keyframe:
            return Keyframe(hand_pose(rubbish + offset, DOWN, yaw), yaw, straight)

        over = Keyframe(hand_pose(high, DOWN, bin_yaw), bin_yaw)
        inside = Keyframe(hand_pose(low, DOWN, bin_yaw), bin_yaw, straight=True)
        back = Keyframe(over.T_base_ee, bin_yaw, straight=True)
        return [
            Move([grasp(ABOVE + self._draw_via(rng))], 1.0, pace=SIDEWAYS[0]),
            Move([grasp(np.zeros(3), straight=True)], 1.0),
            Move([grasp(ABOVE, straight=True)], 0.0),
            Move([over], 0.0, pace=SIDEWAYS[1]),
            Move([inside], 0.0),
            Move([back], 1.0),
        ]
