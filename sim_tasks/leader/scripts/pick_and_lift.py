"""The script of Pick and Lift."""

import numpy as np

from sim_tasks.leader.scripts.grasp import CarryLeader
from sim_tasks.tasks.pick_and_lift import RED, PickAndLift

QUARTER = np.pi / 2  # [rad] after which a cube looks the same


class PickAndLiftLeader(CarryLeader[PickAndLift]):
    """The fingers on two sides of the block: those that need the smallest turn of the hand."""

    def _yaw(self) -> float:
        R = self._world.rotation(RED)
        block, arm = np.arctan2(R[1, 0], R[0, 0]), super()._yaw()
        return float(block + QUARTER * np.round((arm - block) / QUARTER))
