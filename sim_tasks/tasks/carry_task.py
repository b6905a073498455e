"""The base of the tasks in which one thing is grasped and carried to a mark."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH, ObjectTask, add_goal
from sim_tasks.tasks.rewards import Reward, closeness

MARK = "mark"
MARK_RADIUS, MARK_COLOUR = 0.025, (0.15, 0.75, 0.25, 0.45)  # [m]; translucent
ARRIVED = 0.04  # [m] from the mark at which the carried thing is there


class GraspTask(ObjectTask):
    """Grasp the target and lift it; subclasses say how far the lift is done."""

    target: ClassVar[str]  # one of ``graspable``
    grasp_offset: ClassVar[tuple[float, float, float]]  # [m] the point between the fingers, in the target's frame
    reward = Reward(reach=0.375, lift=0.375, success=0.25)

    @property
    def needed(self) -> tuple[str, ...]:
        return (self.target,)

    @property
    def grasp_point(self) -> Vector:
        """Where the fingers are to close, in the base frame (3,) [m]."""
        return self.point(self.target, self.grasp_offset)

    def _approach(self) -> float:
        """Progress in (0, 1] of the empty hand towards the grasp."""
        return self._reach(self.grasp_point)

    @abstractmethod
    def _lift(self) -> float:
        """Progress in [0, 1] of lifting the held target, 1 once done."""

    def _succeeds(self) -> bool:
        return self.held == self.target and self._lift() == 1.0

    def _progress(self) -> dict[str, float]:
        if self.held == self.target:
            return {"reach": 1.0, "lift": self._lift()}
        return {"reach": self._approach(), "lift": 0.0}


class CarryTask(GraspTask):
    """Grasp the target and bring it to the mark: done once its grasp point is there."""

    reward = Reward(reach=0.125, lift=0.5, success=0.375)

    def _build(self, spec: mujoco.MjSpec) -> None:
        add_goal(spec, MARK, MARK_RADIUS, MARK_COLOUR)

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {self.target: self.grasp_point - self.tip, MARK: self.position(MARK) - self.grasp_point}

    def _lift(self) -> float:
        distance = float(np.linalg.norm(self.grasp_point - self.position(MARK)))
        return 1.0 if distance < ARRIVED else closeness(distance, WIDTH)
