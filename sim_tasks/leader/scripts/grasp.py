"""The leader's base for tasks in which one thing is grasped from above and lifted."""

from abc import abstractmethod
from collections.abc import Sequence

import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.leader.hand import DOWN, hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.carry_task import MARK, CarryTask, GraspTask

ABOVE = np.array([0.0, 0.0, 0.10])  # [m] from the grasp to the via point
GENTLE = 0.6  # pace of the last part of the way to the grasp


class GraspLeader[Task: GraspTask](MovesLeader[Task]):
    """Over the target, straight down, grasp, and straight on to where it is to be; any elbow will do."""

    @abstractmethod
    def _goal(self) -> Vector:
        """Where the grasp point is to be carried, (3,) [m]."""

    def _yaw(self) -> float:
        """The hand's turn [rad] about the vertical: that of the arm, unless the target asks for another."""
        x, y, _ = self._world.grasp_point
        return float(np.arctan2(y, x))

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        grasp, yaw = self._world.grasp_point, self._yaw()
        via = hand_pose(grasp + ABOVE + self._draw_via(rng), DOWN, yaw)
        return (
            Move([Keyframe(via, None)], 1.0),
            Move([Keyframe(hand_pose(grasp, DOWN, yaw), None, straight=True)], 1.0, pace=GENTLE),
            Move([Keyframe(hand_pose(self._goal(), DOWN, yaw), None, straight=True)], 0.0),
        )


class CarryLeader[Task: CarryTask](GraspLeader[Task]):
    """Carries the target to the mark."""

    def _goal(self) -> Vector:
        return self._world.position(MARK)
