"""The leader: a second, simulated arm without obstacles that follows a script with its servos."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from sim_tasks.leader.motion import Stretch
from sim_tasks.world.robot import RobotModel, robot_spec


class Leader:
    """The arm that a person would hold; what it does is what the follower is told to do."""

    def __init__(self, arm: Arm, period: float) -> None:
        self._arm = arm
        self._period = period
        self._model = robot_spec(arm).compile()
        self._robot = RobotModel.of(self._model, arm)
        self._substeps = round(period / self._model.opt.timestep)

    def perform(self, start: Vector, script: Sequence[Stretch], speed: float) -> Iterator[np.ndarray]:
        """Play a script; yield the leader's joint angles [rad] and gripper opening (n+1,) each period.

        Args:
            start: (n,) [rad] where the leader rests before.
            script: The stretches, one after the other.
            speed: Share of the joints' velocity limits that the fastest joint reaches.
        """
        data = mujoco.MjData(self._model)
        self._robot.place(data, start, script[0].gripper)
        mujoco.mj_forward(self._model, data)
        before = script[0].gripper
        for stretch in script:
            targets = stretch.sample(self._arm, self._period, speed)
            for target, opening in zip(targets, stretch.openings(before, self._period, len(targets)), strict=True):
                self._robot.command(data, target, opening)
                mujoco.mj_step(self._model, data, nstep=self._substeps)
                # The trigger's opening, not the fingers': what they hold is the follower's to find out.
                yield np.append(data.qpos[self._robot.joint_qpos], opening)
            before = stretch.gripper
