"""The scripted leader as a LeRobot teleoperator: ``--teleop.type=er_il_scripted_leader``."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from lerobot.lerobot_types import RobotAction
from lerobot.teleoperators import Teleoperator, TeleoperatorConfig
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from er_il.arms.arm import Vector
from er_il.envs.protocol import arm_env, demonstrable_env
from er_il.envs.tasks import task_id
from er_il.robots.hardware.calibration import NeedsNoCalibration
from er_il.robots.hardware.episodes import EpisodeAnnouncements
from er_il.robots.hardware.joints import JointNames


@TeleoperatorConfig.register_subclass("er_il_scripted_leader")
@dataclass(kw_only=True)
class ScriptedLeaderConfig(TeleoperatorConfig):
    """A leader arm that demonstrates a task by itself.

    Attributes:
        task: Name of the task.
        arm: Name of the arm.
        seed: Seed of the session's first episode, the same as the simulated follower's; each later one adds one.
        units: Of the joints' positions: ``deg`` or ``rad``. The gripper's opening is in [0, 1].
    """

    task: str = "reach_cup"
    arm: str = "panda"
    seed: int = 0
    units: str = "deg"


class ScriptedLeader(NeedsNoCalibration, Teleoperator):
    """An arm that plays the demonstration of the world that its seed names, then holds its last pose.

    It has a world of its own to look at, so the follower may be any robot with these joints; a
    simulated follower with the same seed stands before the same objects.
    """

    config_class = ScriptedLeaderConfig
    name = "er_il_scripted_leader"

    def __init__(self, config: ScriptedLeaderConfig) -> None:
        """Prepare the leader; ``connect`` makes it plan.

        Raises:
            UnknownNameError: no such task, arm or unit.
        """
        super().__init__(config)
        self.config = config
        self._env: gymnasium.Env[Any, Any] = gymnasium.make(
            task_id(config.task), max_episode_steps=-1, disable_env_checker=True, arm=config.arm
        )
        self._world = demonstrable_env(self._env)
        self._joints = JointNames(arm_env(self._env).arm.joints, config.units)
        self._announcements = EpisodeAnnouncements()
        self._script: Iterator[Vector] | None = None
        self._last: Vector = np.zeros(len(self._joints.names))
        self._episode = 0

    @property
    def action_features(self) -> dict[str, Any]:
        return dict.fromkeys(self._joints.names, float)

    @property
    def feedback_features(self) -> dict[str, Any]:
        return {}

    @property
    def is_connected(self) -> bool:
        return self._script is not None

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        self._announcements.listen()
        self._plan(0)

    @check_if_not_connected
    def get_action(self) -> RobotAction:
        if self._announcements.episode != self._episode:
            self._plan(self._announcements.episode)
        assert self._script is not None
        self._last = next(self._script, self._last)
        return self._joints.to_robot(self._last)

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing: a script feels no forces."""

    @check_if_not_connected
    def disconnect(self) -> None:
        self._announcements.stop()
        self._script = None
        self._env.close()

    def _plan(self, episode: int) -> None:
        """Look at the episode's world and plan its demonstration.

        Raises:
            PlanError: no collision-free motion exists.
        """
        seed = self.config.seed + episode
        self._env.reset(seed=seed)
        self._script = self._world.leader(seed)
        self._episode = episode
