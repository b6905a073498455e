"""The leader arm: a second, simulated arm without obstacles that follows a script with its servos."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from sim_tasks.leader.motion import Segment
from sim_tasks.world.robot import RobotModel, robot_spec


class LeaderArm:
    """The arm that a person would hold; its measured motion is the follower's command."""

    def __init__(self, arm: Arm, period: float) -> None:
        self._arm = arm
        self._period = period
        self._model = robot_spec(arm).compile()
        self._robot = RobotModel.of(self._model, arm)
        self._substeps = round(period / self._model.opt.timestep)

    def perform(self, start: Vector, script: Sequence[Segment], speed: float) -> Iterator[np.ndarray]:
        """Play a script; yield the leader's joint angles [rad] and gripper opening (n+1,) each period.

        Args:
            start: (n,) [rad] initial joint angles.
            script: Consecutive segments.
            speed: Share of the joints' velocity limits that the fastest joint reaches.
        """
        data = mujoco.MjData(self._model)
        self._robot.place(data, start, script[0].gripper)
        mujoco.mj_forward(self._model, data)
        before = script[0].gripper
        for segment in script:
            targets = segment.sample(self._arm.velocity, self._period, speed)
            for target, opening in zip(targets, segment.openings(before, self._period, len(targets)), strict=True):
                self._robot.command(data, target, opening)
                mujoco.mj_step(self._model, data, nstep=self._substeps)
                # The commanded opening, not the fingers': only the follower's fingers meet the object.
                yield np.append(data.qpos[self._robot.joint_qpos], opening)
            before = segment.gripper
