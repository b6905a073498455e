"""A Franka arm that a person guides, as a LeRobot teleoperator: ``--teleop.type=er_il_franka_leader``."""

from typing import Any

import numpy as np
from lerobot.lerobot_types import RobotAction
from lerobot.teleoperators import Teleoperator
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

from er_il.robots.hardware.calibration import NeedsNoCalibration
from er_il.robots.hardware.franka_arm import FrankaArm
from er_il.robots.hardware.franka_config import FrankaLeaderConfig, franka_arm
from er_il.robots.hardware.franka_hand import FrankaHand
from er_il.robots.hardware.joints import JointNames


class FrankaLeader(NeedsNoCalibration, Teleoperator):
    """A leader whose joints and fingers the follower mirrors.

    It is never commanded: a person guides it by the buttons at its wrist, with which it carries its own weight.
    """

    config_class = FrankaLeaderConfig
    name = "er_il_franka_leader"

    def __init__(self, config: FrankaLeaderConfig) -> None:
        """Prepare the leader; ``connect`` starts to read it.

        Raises:
            UnknownNameError: no such arm or unit.
        """
        super().__init__(config)
        self.config = config
        self._joints = JointNames(franka_arm(config.arm).joints, config.units, config.gripper)
        self._arm: FrankaArm | None = None
        self._hand: FrankaHand | None = None

    @property
    def action_features(self) -> dict[str, Any]:
        return dict.fromkeys(self._joints.names, float)

    @property
    def feedback_features(self) -> dict[str, Any]:
        return {}

    @property
    def is_connected(self) -> bool:
        return self._arm is not None

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        """Connect to arm and hand.

        Raises:
            RobotError: one of them does not answer.
        """
        try:
            self._arm = FrankaArm(self.config.address)
            if self.config.gripper:
                self._hand = FrankaHand(self._arm, force=0.0)
        except BaseException:
            self.disconnect()
            raise

    @check_if_not_connected
    def get_action(self) -> RobotAction:
        assert self._arm is not None
        values = self._arm.measure()
        if self._hand is not None:
            values = np.append(values, self._hand.opening())
        return self._joints.to_robot(values)

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing: the leader does not feel what the follower touches."""

    def disconnect(self) -> None:
        """End the connections; does nothing if there are none."""
        hand, arm = self._hand, self._arm
        self._hand = self._arm = None
        if arm is not None:
            arm.close()
        if hand is not None:
            hand.close()
