"""Reach Target: bring the hand to a ball in free space (paper V-A)."""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.solver import kinematics_of
from sim_tasks.tasks.object_task import WIDTH, ObjectTask, add_goal
from sim_tasks.tasks.placement import Placement
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.randomisation import sides

BALL = "ball"
RADIUS = 0.05  # [m] from the ball's centre at which it counts as reached
HEIGHTS = (0.15, 0.65)  # [m] above the bench
AWAY = 0.15  # [m] from where the hand starts, at least


class ReachTarget(ObjectTask):
    """The tip of the hand in the ball."""

    task = "reach_target"
    task_description = "Reach the red ball."
    objects = (BALL,)
    arms = ("panda", "panda8")
    centre = (0.475, 0.0)  # x, y [m] of the middle of the balls' places
    reward = Reward(reach=0.75, success=0.25)

    def __init__(self, *, ball_range: tuple[float, float] = (0.25, 0.50), **kwargs: Any) -> None:
        """Build the task.

        Args:
            ball_range: Sides [m] of the rectangle above which the ball is.
            kwargs: See :class:`ObjectTask`.
        """
        self._ball_range = sides("ball_range", ball_range)
        self._height = 0.0  # [m] of the ball in this episode
        super().__init__(**kwargs)

    def _build(self, spec: mujoco.MjSpec) -> None:
        add_goal(spec, BALL, 0.03, (0.85, 0.1, 0.1, 1.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        start = kinematics_of(self.arm).fk(self.nominal_start)[:3, 3]
        while True:
            x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._ball_range
            self._height = rng.uniform(*HEIGHTS)
            if np.linalg.norm(start - (x, y, self._height + self.shoulder_offset)) > AWAY:
                return {BALL: (x, y, 0.0)}

    def _arrange(self, placement: Placement) -> None:
        x, y, _ = placement[BALL]
        self._put(BALL, (x, y, self._height))

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {BALL: self.position(BALL) - self.tip}

    def _distance(self) -> float:
        return math.dist(self.tip, self.position(BALL))

    def _succeeds(self) -> bool:
        return self._distance() < RADIUS

    def _progress(self) -> dict[str, float]:
        return {"reach": 1.0 if self._succeeds() else closeness(self._distance(), WIDTH)}
