"""The script of Pick Up Cup."""

import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.leader.scripts.grasp import GraspLeader
from sim_tasks.tasks.pick_up_cup import LEFT, PickUpCup

BEYOND = 0.04  # [m] by which the cup is lifted beyond where it has left its place


class PickUpCupLeader(GraspLeader[PickUpCup]):
    """Straight up."""

    def _goal(self) -> Vector:
        return self._world.grasp_point + np.array([0.0, 0.0, LEFT + BEYOND])
