"""Take Cup Out Cabinet: take a cup out of an open cabinet that stands turned before the robot (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH, ObjectTask, add_goal
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.cupboard import Cupboard
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.tableware import CUP_HEIGHT, cup

CUP, CABINET, GOAL = "cup", "cabinet", "goal"
MIDDLE = (0.0, 0.0, CUP_HEIGHT / 2)  # [m] of the cup, in its frame
REACHED = 0.05  # [m] from the goal to the middle of a cup that is there
PLACE = (0.62, 0.0)  # x, y [m] of the cabinet's middle
OUTSIDE = 0.12  # [m] from the opening to the goal
GOAL_HEIGHT = 0.10  # [m] mean, above the compartment's floor


class TakeCupOutCabinet(ObjectTask):
    """Grasp the cup and take it to a goal before the opening, which faces anywhere from left to right."""

    task = "take_cup_out_cabinet"
    task_description = "Take the cup out of the cabinet."
    objects = (CUP, CABINET, GOAL)
    graspable = (CUP,)
    arms = ("panda", "panda8")
    cabinet = Cupboard()
    start = (0.0, -1.357, 0.0, -2.584, 0.0, 2.099, np.pi / 4)  # the hand forward, well before the cabinet
    reward = Reward(reach=0.125, take=0.5, success=0.375)

    def __init__(
        self,
        *,
        cabinet_yaw_range: float = 1.5708,
        cup_range: tuple[float, float] = (0.04, 0.06),
        goal_range: tuple[float, float] = (0.06, 0.06),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            cabinet_yaw_range: The cabinet is turned up to this far [rad].
            cup_range: Sides [m] of the rectangle on the compartment's floor in which the cup stands: depth, width.
            goal_range: Sides [m] of the upright rectangle before the opening in which the goal is: width, height.
            kwargs: See :class:`ObjectTask`.
        """
        self._cabinet_yaw_range = span("cabinet_yaw_range", cabinet_yaw_range)
        self._cup_range = sides("cup_range", cup_range)
        self._goal_range = sides("goal_range", goal_range)
        self._height = 0.0  # [m] of the goal in this episode
        super().__init__(**kwargs)

    @property
    def grasp_point(self) -> Vector:
        """The middle of the cup (3,) [m]."""
        return self.point(CUP, MIDDLE)

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {CUP: self.grasp_point - self.tip, GOAL: self.position(GOAL) - self.grasp_point}

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {CABINET: self.rotation(CABINET)[:, 0]}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cabinet.add(spec, CABINET)
        cup().add(spec, CUP, (0.0, 0.0, self.cabinet.floor))
        add_goal(spec, GOAL, 0.02, (0.10, 0.70, 0.20, 0.8))

    def _draw(self, rng: np.random.Generator) -> Placement:
        turn = rng.uniform(-self._cabinet_yaw_range, self._cabinet_yaw_range)
        axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        x, y = PLACE + axes @ ((rng.random(2) - 0.5) * self._cup_range)
        aside, up = (rng.random(2) - 0.5) * self._goal_range
        goal_x, goal_y = PLACE + axes @ (-self.cabinet.depth / 2 - OUTSIDE, aside)
        self._height = self.cabinet.floor + GOAL_HEIGHT + up
        return {
            CUP: (float(x), float(y), 0.0),
            CABINET: (*PLACE, turn),
            GOAL: (float(goal_x), float(goal_y), 0.0),
        }

    def _arrange(self, placement: Placement) -> None:
        heights = {CUP: self.cabinet.floor, CABINET: 0.0, GOAL: self._height}
        for name, (x, y, yaw) in placement.items():
            self._put(name, (x, y, heights[name]), yawed(yaw))

    def _distance(self) -> float:
        return float(np.linalg.norm(self.grasp_point - self.position(GOAL)))

    def _succeeds(self) -> bool:
        return self.grasped and self._distance() < REACHED

    def _progress(self) -> dict[str, float]:
        if not self.grasped:
            return {"reach": self._reach(self.grasp_point), "take": 0.0}
        return {"reach": 1.0, "take": 1.0 if self._succeeds() else closeness(self._distance(), WIDTH)}
