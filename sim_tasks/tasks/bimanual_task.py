"""The base of the tasks for OpenArm's two arms."""

from abc import ABC
from typing import Any, ClassVar

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.arms.openarm import mirrored
from er_il.arms.robot import robot_arms
from er_il.support.errors import UnknownNameError
from sim_tasks.tasks.observation import Observer
from sim_tasks.tasks.robot_task import RobotTask
from sim_tasks.tasks.targets import JointTargets
from sim_tasks.world.camera import View
from sim_tasks.world.openarm import openarm_models, openarm_spec
from sim_tasks.world.scene import add_room


class BimanualTask(RobotTask, ABC):
    """A task for two arms. Subclasses build the world, place its objects, judge and reward.

    Action: Box(16,): the left arm's joint position targets [rad] and its gripper's opening in [0, 1] (1 open), then the
    right arm's. ``agent_pos`` (30,): both arms' joint positions [rad], both openings, then the left hand's position [m]
    and quaternion (x, y, z, w), then the right hand's. All positions are in the arms' common base frame.
    """

    robots: ClassVar[tuple[str, ...]] = ("openarm_v2",)
    views: ClassVar[tuple[View, ...]]  # the cameras
    start: ClassVar[tuple[float, ...]]  # (7,) [rad] of the left arm; the right arm's mirrors it

    def __init__(self, *, arm: str = "openarm_v2", **kwargs: Any) -> None:
        """Build the world.

        Args:
            arm: Name of the robot, follower and leader, one of the task's ``robots``.
            kwargs: See :class:`RobotTask`.
        """
        super().__init__(arm=arm, **kwargs)

    def _choose(self, name: str) -> None:
        if name not in self.robots:
            raise UnknownNameError(f"robot for {self.task}", name, self.robots)
        self.arms = robot_arms(name)

    def world_spec(self) -> mujoco.MjSpec:
        spec = openarm_spec(self.arms)
        add_room(spec)
        for view in self.views:
            view.add(spec, 0.0)
        self._build(spec)
        return spec

    def _connect(self) -> None:
        self.models = openarm_models(self.model, self.arms)
        self.bodies = frozenset().union(*(model.bodies for model in self.models))
        self.observer = Observer(self.arms, self.model, self.models, self.objects, self._cameras)
        self.targets = JointTargets(self.arms)

    @property
    def nominal_start(self) -> Vector:
        """Joint angles (14,) [rad] around which episodes start."""
        return np.array([*self.start, *mirrored(self.start)])

    def _draw_start(self, rng: np.random.Generator) -> Vector:
        start = self.nominal_start
        return start + rng.uniform(-self._start_range, self._start_range, len(start))

    def _rest(self, q: Vector) -> None:
        for model, angles in zip(self.models, np.split(q, len(self.models)), strict=True):
            model.place(self.data, angles, 1.0)

    def _drive(self, command: Vector) -> None:
        for model, targets in zip(self.models, np.split(command, len(self.models)), strict=True):
            model.command(self.data, targets[:-1], targets[-1])

    @property
    def joint_positions(self) -> Vector:
        """The follower's true joint angles (14,) [rad], left then right."""
        return np.concatenate([model.joint_positions(self.data) for model in self.models])

    @property
    def gripper_openings(self) -> Vector:
        """The grippers' true openings (2,) in [0, 1]."""
        return np.array([model.opening(self.data) for model in self.models])
