"""A robot that takes encoded actions: ``--robot.type=er_il_arm``, any robot of LeRobot's with the decoder inside."""

import time
from typing import Any, cast

import numpy as np
from lerobot.lerobot_types import RobotAction, RobotObservation
from lerobot.robots import Robot, RobotConfig, make_robot_from_config
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from er_il.arms.arm import Vector
from er_il.robots.command_line import DECODING_ROBOT
from er_il.robots.hardware.decoding_config import DecodingRobotConfig
from er_il.robots.hardware.episodes import EpisodeAnnouncements
from er_il.robots.hardware.joint_vector import JointVector, bare
from er_il.robots.hardware.joints import POSITION
from er_il.robots.hardware.pace import Pace
from er_il.robots.robot_commander import RobotCommander
from er_il.spaces.joint import JOINT
from er_il.support.errors import ErIlError

PASSED = (POSITION, ".vel")  # endings of the actions that lerobot-rollout sends to a robot


class DecodingRobot(Robot):
    """Decodes encoded actions for the robot inside, one at a time, when they are sent.

    Its actions are named as the encoded dimensions, with ``.pos`` behind those that have no ending that LeRobot's
    rollout passes on; they are accepted without it, as datasets name them. Joints, all of them in one action, go to the
    inner robot as they are: LeRobot drives a robot back to where it started by the joints it observed there. What it
    observes is the inner robot's.
    """

    config_class = DecodingRobotConfig
    name = DECODING_ROBOT

    def __init__(self, config: DecodingRobotConfig) -> None:
        """Prepare the robot, and the one inside.

        Raises:
            ErIlError: the actions are unknown, not those of the command's policy, or not for this robot.
        """
        super().__init__(config)
        self.config = config
        self._inner = make_robot_from_config(cast(RobotConfig, config.inner))
        takes, measures = _numbers(self._inner.action_features), _numbers(self._inner.observation_features)
        actions = config.actions(takes, measures)
        self._layout = layout = actions.layout
        self._period = 1.0 / actions.rate
        self._commander = RobotCommander(layout, self._period, config.on_invalid)
        self._pace = Pace(actions.rate)
        self._joints = JointVector(layout, takes, measures)
        self._announcements = EpisodeAnnouncements()
        self._episode = 0
        self._observation: RobotObservation | None = None  # the latest, until an action was decoded from it
        self._observed_at = 0.0  # [s]

    @property
    def observation_features(self) -> dict[str, Any]:
        return self._inner.observation_features

    @property
    def action_features(self) -> dict[str, Any]:
        return {name if name.endswith(PASSED) else name + POSITION: float for name in self._layout.encoded_names}

    @property
    def cameras(self) -> dict[str, Any]:
        """The inner robot's cameras, which stock commands count."""
        return getattr(self._inner, "cameras", {})

    @property
    def is_connected(self) -> bool:
        return self._inner.is_connected

    @property
    def is_calibrated(self) -> bool:
        return self._inner.is_calibrated

    def calibrate(self) -> None:
        self._inner.calibrate()

    def configure(self) -> None:
        self._inner.configure()

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Connect the inner robot.

        Raises:
            ErIlError: it measures joints far outside of the arm's limits.
        """
        self._inner.connect(calibrate)
        self._announcements.listen()
        self._episode = 0
        try:
            self._joints.check(self._measured())
        except Exception:
            self.disconnect()
            raise

    @check_if_not_connected
    def get_observation(self) -> RobotObservation:
        self._observation, self._observed_at = self._inner.get_observation(), time.monotonic()
        return dict(self._observation)

    @check_if_not_connected
    def send_action(self, action: RobotAction) -> RobotAction:
        """Decode an action from the joints of this control period, and send the command to the inner robot.

        Args:
            action: The encoded dimensions by name, or the inner robot's joints.

        Returns:
            The action.

        Raises:
            ErIlError: it lacks a dimension, or the measured joints are not finite.
        """
        values = {bare(name): float(value) for name, value in action.items()}
        if self._layout.commands != JOINT and all(bare(name) in values for name in self._layout.names):
            names = (name for name in self._inner.action_features if bare(name) in values)
            return self._inner.send_action({name: values[bare(name)] for name in names})
        if missing := [name for name in self._layout.encoded_names if bare(name) not in values]:
            raise ErIlError(
                f"The action lacks {', '.join(missing)}; it has {', '.join(action)}. {DECODING_ROBOT} takes "
                f"{', '.join(self.action_features)}, or the joints {', '.join(self._joints.names)}."
            )
        if self._announcements.episode != self._episode:
            self._episode = self._announcements.episode
            self._commander.reset()
        self._pace.tick()
        encoded = np.array([values[bare(name)] for name in self._layout.encoded_names])
        command = self._commander.command(encoded, self._measured())
        self._inner.send_action(self._joints.named(command.vector))
        return dict(zip(self.action_features, encoded.tolist(), strict=True))

    @check_if_not_connected
    def disconnect(self) -> None:
        self._commander.reset()  # tells what became of the last episode's actions
        self._announcements.stop()
        self._observation = None
        self._inner.disconnect()

    def _measured(self) -> Vector:
        """The joint vector (D,) as it is measured now, or was in this period; NaN where nothing measures.

        LeRobot's loops observe before they act, but for the asynchronous client, which acts on a chunk meanwhile.
        """
        observation, self._observation = self._observation, None
        if observation is None or time.monotonic() - self._observed_at > self._period:
            observation = self._inner.get_observation()
        return self._joints.measured(observation)


def _numbers(features: dict[str, Any]) -> tuple[str, ...]:
    """Names of the features that are numbers, not images."""
    return tuple(name for name, kind in features.items() if not isinstance(kind, tuple))
