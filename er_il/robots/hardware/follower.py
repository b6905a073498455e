"""The simulated follower as a LeRobot robot: ``--robot.type=er_il_sim``."""

import logging
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
from lerobot.lerobot_types import RobotAction, RobotObservation
from lerobot.robots import Robot, RobotConfig
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from er_il.envs.protocol import arm_env
from er_il.envs.tasks import task_id
from er_il.robots.hardware.calibration import NeedsNoCalibration
from er_il.robots.hardware.episodes import EpisodeAnnouncements
from er_il.robots.hardware.joints import POSITION, JointNames

logger = logging.getLogger(__name__)


@RobotConfig.register_subclass("er_il_sim")
@dataclass(kw_only=True)
class SimFollowerConfig(RobotConfig):
    """A simulated arm in a task's world.

    Attributes:
        task: Name of the task.
        arm: Name of the arm.
        seed: Seed of the world in the session's first episode; each later episode adds one.
        camera_names: Cameras to observe.
        image_size: Width and height of their images [px].
        units: Of the joints' positions: ``deg``, as LeRobot's robots, or ``rad``. The gripper's opening is in [0, 1].
        pose: Observe the end effector's position [m] and quaternion, too, as the generated datasets do.
    """

    task: str = "reach_cup"
    arm: str = "panda"
    seed: int = 0
    camera_names: list[str] = field(default_factory=lambda: ["wrist"])
    image_size: int = 96
    units: str = "deg"
    pose: bool = False


class SimFollower(NeedsNoCalibration, Robot):
    """A follower arm in its simulated world, which stands still between two actions.

    Every action takes one control period (``fps``) of the world's time, however long that lasts: the
    same actions always lead to the same states. Run the stock commands at that rate.
    """

    config_class = SimFollowerConfig
    name = "er_il_sim"

    def __init__(self, config: SimFollowerConfig) -> None:
        """Prepare the robot; ``connect`` starts its world.

        Raises:
            UnknownNameError: no such task, arm or unit.
        """
        super().__init__(config)
        self.config = config
        # A world that has ended (success, failure) goes on, as the real one does.
        self._env: gymnasium.Env[Any, Any] = gymnasium.make(
            task_id(config.task),
            max_episode_steps=-1,
            disable_env_checker=True,
            arm=config.arm,
            cameras=tuple(config.camera_names),
            image_size=config.image_size,
        )
        world = arm_env(self._env)
        self._joints = JointNames(world.arm.joints, config.units)
        self._pose_names = tuple(f"{name}{POSITION}" for name in world.state_names[len(self._joints.names) :])
        size = config.image_size
        # Stock commands count the cameras; there is nothing to connect to.
        self.cameras = dict.fromkeys(config.camera_names, (size, size, 3))
        self._announcements = EpisodeAnnouncements()
        self._observation: dict[str, Any] | None = None
        self._episode = 0
        self._steps = 0
        self._ended = False

    @property
    def observation_features(self) -> dict[str, Any]:
        names = self._joints.names + (self._pose_names if self.config.pose else ())
        return {**dict.fromkeys(names, float), **self.cameras}

    @property
    def action_features(self) -> dict[str, Any]:
        return dict.fromkeys(self._joints.names, float)

    @property
    def fps(self) -> int:
        """Control steps in one second of the world's time."""
        return self._env.metadata["render_fps"]

    @property
    def is_connected(self) -> bool:
        return self._observation is not None

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        self._announcements.listen()
        self._restart(0)

    @check_if_not_connected
    def get_observation(self) -> RobotObservation:
        if self._announcements.episode != self._episode:
            self._restart(self._announcements.episode)
        assert self._observation is not None
        state = self._observation["agent_pos"]
        count = len(self._joints.names)
        named = self._joints.to_robot(state[:count].astype(np.float64))
        if self.config.pose:
            named |= dict(zip(self._pose_names, state[count:].tolist(), strict=True))
        return {**named, **self._observation.get("pixels", {})}

    @check_if_not_connected
    def send_action(self, action: RobotAction) -> RobotAction:
        box = self._env.action_space
        assert isinstance(box, gymnasium.spaces.Box)
        target = np.clip(self._joints.from_robot(action), box.low, box.high)
        self._observation, _, _, _, info = self._env.step(target)
        self._steps += 1
        if not self._ended and (info["is_success"] or info["failure"]):
            self._ended = True
            outcome = info["failure"] or "success"
            logger.info("Simulated episode %d: %s after %d steps", self._episode, outcome, self._steps)
        return self._joints.to_robot(target)

    @check_if_not_connected
    def disconnect(self) -> None:
        self._announcements.stop()
        self._observation = None
        self._env.close()

    def _restart(self, episode: int) -> None:
        self._observation, _ = self._env.reset(seed=self.config.seed + episode)
        self._episode, self._steps, self._ended = episode, 0, False
