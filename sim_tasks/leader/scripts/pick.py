"""The script by which an object is picked: approach, close the gripper, carry."""

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np

from sim_tasks.leader.collision import Collisions
from sim_tasks.leader.leader import REST, Leader
from sim_tasks.leader.motion import Keyframe, Segment, plan_path
from sim_tasks.tasks.pick_task import PickTask

GRASP_TIME = 0.5  # [s] that the hand rests once the fingers are commanded to be closed


class PickLeader[Task: PickTask](Leader[Task]):
    """Leads the hand to an object, grasps it and carries it."""

    clearance: ClassVar[float]  # [m] that the plan keeps from the obstacles
    approach_pace: ClassVar[float] = 1.0  # share of the script's speed until the grasp

    def _obstacles(self) -> tuple[str, ...]:
        """Bodies that the plan must not touch."""
        return self._world.obstacles

    @abstractmethod
    def _keyframes(self, rng: np.random.Generator) -> tuple[Sequence[Keyframe], Sequence[Keyframe]]:
        """Keyframes of the approach, up to the grasp, and of the retreat with the object."""

    def _draw_closing(self, rng: np.random.Generator) -> float:
        """Duration [s] of the command that closes the gripper."""
        return 0.0

    @cached_property
    def _collisions(self) -> Collisions:
        return Collisions.of_arm(self._world.world_spec(), self._world.arm, self._obstacles(), self.clearance)

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        world = self._world
        approach, retreat = self._keyframes(rng)
        self._collisions.copy(world.data)
        to_grasp = plan_path(world.arm, world.joint_positions, approach, self._collisions.is_free)
        carry = plan_path(world.arm, to_grasp[-1], retreat, self._collisions.is_free)
        speed, closing = self._draw_speed(rng), self._draw_closing(rng)
        script = [
            Segment(to_grasp, gripper=1.0, pace=self.approach_pace),
            Segment(to_grasp[-1:], gripper=0.0, closing=closing, hold=closing + GRASP_TIME),
            Segment(carry, gripper=0.0, hold=REST),
        ]
        return script, speed
