"""The base of the tasks for one arm."""

from abc import ABC
from functools import cached_property
from typing import Any, ClassVar

import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import UnknownNameError
from sim_tasks.tasks.observation import Observer
from sim_tasks.tasks.robot_task import RobotTask
from sim_tasks.tasks.targets import JointTargets
from sim_tasks.world.clearance import Clearance
from sim_tasks.world.robot import FINGER_BODIES, RobotModel, shoulder_offset
from sim_tasks.world.scene import scene_spec


class ArmTask(RobotTask, ABC):
    """A task for one arm with the Panda's hand. Subclasses build the world, place its objects, judge and reward.

    Action: Box(n+1,): joint position targets [rad] and the gripper's opening in [0, 1] (1 open).
    ``agent_pos`` (n+8,): joint positions [rad], gripper opening, end-effector position [m] and quaternion (x, y, z, w).
    """

    arms: ClassVar[tuple[str, ...]] = ("panda",)  # presets that can do the task
    start: ClassVar[tuple[float, ...]]  # (7,) [rad] of the last seven joints; the joints below them start at home

    def __init__(self, *, arm: str = "panda", **kwargs: Any) -> None:
        """Build the world.

        Args:
            arm: Preset of the follower and the leader, one of the task's ``arms``.
            kwargs: See :class:`RobotTask`.
        """
        super().__init__(arm=arm, **kwargs)

    def _choose(self, name: str) -> None:
        if name not in self.arms:
            raise UnknownNameError(f"arm for {self.task}", name, self.arms)
        self.arm = Arm.preset(name)
        # Tasks are measured from a Panda's shoulder: objects before an arm that is taller stand higher, too.
        self.shoulder_offset = shoulder_offset(self.arm)

    def world_spec(self) -> mujoco.MjSpec:
        spec = scene_spec(self.arm)
        self._build(spec)
        return spec

    def _connect(self) -> None:
        self.robot = RobotModel.of(self.model, self.arm)
        self.bodies = self.robot.bodies
        self._fingers = [{self.model.body(name).id} for name in FINGER_BODIES]
        self.observer = Observer({"": self.arm}, self.model, [self.robot], self.objects, self._cameras)
        self.targets = JointTargets({"": self.arm})

    def _draw_start(self, rng: np.random.Generator) -> Vector:
        start = self.nominal_start
        start[-len(self.start) :] += rng.uniform(-self._start_range, self._start_range, len(self.start))
        return start

    def _rest(self, q: Vector) -> None:
        self.robot.place(self.data, q, 1.0)

    def _drive(self, command: Vector) -> None:
        self.robot.command(self.data, command[:-1], command[-1])

    def _driven(self, command: Vector) -> None:
        self._grip(command[-1])

    def _grip(self, opening: float) -> None:
        """What a gripper told to have this opening in [0, 1] does besides moving its fingers."""

    @property
    def nominal_start(self) -> Vector:
        """Joint angles (n,) [rad] around which episodes start."""
        return np.append(self.arm.home[: self.arm.dof - len(self.start)], self.start)

    @property
    def joint_positions(self) -> Vector:
        """The follower's true joint angles (n,) [rad]."""
        return self.robot.joint_positions(self.data)

    @property
    def joint_velocities(self) -> Vector:
        """The follower's true joint velocities (n,) [rad/s]."""
        return self.data.qvel[self.robot.joint_dofs]

    @property
    def grasped(self) -> bool:
        """True if the hand holds a thing."""
        return False

    @property
    def touched(self) -> tuple[str, ...]:
        """Bodies that the task has the robot touch, from which its links need not keep clear."""
        return ()

    @property
    def gripper_opening(self) -> float:
        """The gripper's true opening in [0, 1]."""
        return self.robot.opening(self.data)

    @property
    def ee_pose(self) -> np.ndarray:
        """The follower's true end-effector pose T_base_ee (4, 4); the base is the world's origin."""
        return kinematics_of(self.arm).fk(self.joint_positions)

    def clearances(self, q: Vector, most: float) -> Vector:
        """Distances (L,) [m] of the links to the world, were the arm at q (n,) [rad]; see :class:`Clearance`."""
        return self._clearance.distances(self.data, q, most)

    @cached_property
    def _clearance(self) -> Clearance:
        return Clearance(self.model, self.robot, {self.model.body(name).id for name in self.touched})
