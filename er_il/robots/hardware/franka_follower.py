"""A Franka arm as a LeRobot robot: ``--robot.type=er_il_franka``."""

import logging
import threading
import time
from contextlib import suppress
from typing import Any

import numpy as np
from lerobot.cameras import make_cameras_from_configs
from lerobot.lerobot_types import RobotAction, RobotObservation
from lerobot.robots import Robot
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from er_il.arms.arm import Vector
from er_il.robots.hardware.calibration import NeedsNoCalibration
from er_il.robots.hardware.episodes import EpisodeAnnouncements
from er_il.robots.hardware.franka_arm import FrankaArm
from er_il.robots.hardware.franka_config import FrankaFollowerConfig, franka_arm
from er_il.robots.hardware.franka_hand import FrankaHand
from er_il.robots.hardware.joint_guard import JointGuard
from er_il.robots.hardware.joints import JointNames
from er_il.robots.hardware.watchdog import Watchdog
from er_il.support.errors import NumbersError, ReflexError, RobotError

logger = logging.getLogger(__name__)

MARGIN = 0.06  # [rad] to the joint limits; franka-rs refuses targets within 0.05 rad


class FrankaFollower(NeedsNoCalibration, Robot):
    """A follower that moves to joint positions, within its limits, at no more than its share of full speed.

    - An action is limited to what full speed allows since the last one. Without one for ``timeout`` the arm brakes and
      holds. One that is not finite leaves the last standing.
    - A reflex ends the program with one line; between two episodes, and when it connects, the arm is recovered.
    - Disconnecting, also by Ctrl-C, ends the motion; the arm holds.
    """

    config_class = FrankaFollowerConfig
    name = "er_il_franka"

    def __init__(self, config: FrankaFollowerConfig) -> None:
        """Prepare the robot; ``connect`` takes over the arm.

        Raises:
            UnknownNameError: no such arm or unit.
            NumbersError: a speed or timeout that is none.
        """
        super().__init__(config)
        if not 0 < config.speed <= 1:
            raise NumbersError(f"The speed is {config.speed:g}; it is a share of full speed, above 0 and at most 1.")
        if not config.timeout > 0:
            raise NumbersError(f"The timeout is {config.timeout:g} s; it must be positive.")
        self.config = config
        self._model = franka_arm(config.arm)
        self._joints = JointNames(self._model.joints, config.units, config.gripper)
        self._guard = JointGuard(
            self._model.lower + MARGIN, self._model.upper - MARGIN, config.speed * self._model.velocity
        )
        self.cameras = make_cameras_from_configs(config.cameras)
        self._announcements = EpisodeAnnouncements()
        self._episode = 0
        self._arm: FrankaArm | None = None
        self._hand: FrankaHand | None = None
        self._watchdog: Watchdog | None = None
        self._aiming = threading.Lock()  # the watchdog aims, too
        self._sent_at = 0.0  # [s] time of the last action
        self._invalid = False  # the last action was

    @property
    def observation_features(self) -> dict[str, Any]:
        images = {name: (camera.height, camera.width, 3) for name, camera in self.config.cameras.items()}
        return {**dict.fromkeys(self._joints.names, float), **images}

    @property
    def action_features(self) -> dict[str, Any]:
        return dict.fromkeys(self._joints.names, float)

    @property
    def is_connected(self) -> bool:
        return self._arm is not None

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Connect to arm, hand and cameras; the arm is recovered if a reflex had stopped it, and holds.

        Raises:
            RobotError: one of them is not ready.
        """
        try:
            self._arm = FrankaArm(self.config.address)
            self._arm.check_kind(self.config.arm)
            if self.config.gripper:
                self._hand = FrankaHand(self._arm, self.config.grasp_force)
            for camera in self.cameras.values():
                camera.connect()
            self._start(self._arm)
        except BaseException:
            self.disconnect()
            raise
        self._announcements.listen()
        self._episode = 0
        self._watchdog = Watchdog(self.config.timeout, self._hold)

    @check_if_not_connected
    def get_observation(self) -> RobotObservation:
        values = self._ready().measure()
        if self._hand is not None:
            values = np.append(values, self._hand.opening())
        images = {name: camera.read_latest() for name, camera in self.cameras.items()}
        return {**self._joints.to_robot(values), **images}

    @check_if_not_connected
    def send_action(self, action: RobotAction) -> RobotAction:
        wanted = self._joints.from_robot(action)
        self._warn_of(wanted)
        arm = self._ready()
        try:
            with self._aiming:
                now = time.monotonic()
                target = self._guard.target(wanted[: self._model.dof], min(now - self._sent_at, self.config.timeout))
                self._sent_at = now
                arm.aim(target)
        except RobotError:
            self._answer(arm)  # it has stopped just now
            target = arm.measure()
        if self._watchdog is not None:
            self._watchdog.feed()
        if self._hand is not None:
            target = np.append(target, self._hand.aim(float(wanted[-1])))
        return self._joints.to_robot(target)

    def disconnect(self) -> None:
        """End the motion, which the arm holds, and all connections; does nothing if there are none."""
        watchdog, hand, arm = self._watchdog, self._hand, self._arm
        self._watchdog = self._hand = self._arm = None
        self._announcements.stop()
        if watchdog is not None:
            watchdog.end()
        if arm is not None:
            arm.close()
        if hand is not None:
            hand.close()
        for camera in self.cameras.values():
            if camera.is_connected:
                camera.disconnect()

    def _start(self, arm: FrankaArm) -> None:
        arm.start(self.config.speed, self.config.collision_torque, self.config.collision_force)
        self._guard.anchor(arm.measure())
        self._sent_at = time.monotonic()

    def _ready(self) -> FrankaArm:
        """The arm, recovered if it has stopped since the last episode.

        Raises:
            RobotError: it has stopped within one, or cannot be recovered.
        """
        assert self._arm is not None
        if not self._arm.moving:
            self._answer(self._arm)
        self._episode = self._announcements.episode
        return self._arm

    def _answer(self, arm: FrankaArm) -> None:
        with self._aiming:
            failure = arm.end() or RobotError(f"The motion of the arm at {arm.address} has ended.")
        within_episode = not self._announcements.resetting and self._announcements.episode == self._episode
        if within_episode or not isinstance(failure, ReflexError):
            self.disconnect()
            raise failure
        logger.warning("%s No episode was under way: recovering.", failure)
        self._start(arm)

    def _hold(self) -> None:
        """Brake and hold, called by the watchdog."""
        arm = self._arm
        with self._aiming, suppress(RobotError):  # if it has stopped, the next call of LeRobot's tells why
            if arm is None or not arm.moving:
                return
            arm.aim(self._guard.brake(arm.measure(), arm.rest()))
            logger.warning("No action for %g s: the arm holds until the next one.", self.config.timeout)

    def _warn_of(self, wanted: Vector) -> None:
        """Log the first of a row of actions that are not finite."""
        invalid = not np.all(np.isfinite(wanted))
        if invalid and not self._invalid:
            logger.warning("Invalid action (not finite); the last one stands.")
        self._invalid = invalid
