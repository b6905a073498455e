"""Options of Franka arms as LeRobot hardware."""

from dataclasses import dataclass, field

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig
from lerobot.teleoperators import TeleoperatorConfig

from er_il.arms.arm import Arm
from er_il.robots.hardware.franka_arm import FCI_VERSIONS
from er_il.support.errors import UnknownNameError


def franka_arm(name: str) -> Arm:
    """The arm of that name, one of those that speak Franka's protocol.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in FCI_VERSIONS:
        raise UnknownNameError("Franka arm", name, FCI_VERSIONS)
    return Arm.preset(name)


@RobotConfig.register_subclass("er_il_franka")
@dataclass(kw_only=True)
class FrankaFollowerConfig(RobotConfig):
    """A Franka arm with its hand.

    Attributes:
        address: Network address of its control box.
        arm: ``fr3`` or ``panda``.
        units: Of the joints' positions: ``deg``, as LeRobot's robots, or ``rad``. The gripper's opening is in [0, 1].
        gripper: The arm has a Franka Hand.
        speed: Share in (0, 1] of the joints' limits of velocity, acceleration and jerk.
        collision_torque: External torque at a joint [Nm] that stops the arm.
        collision_force: External force [N] or moment [Nm] at the end effector that stops the arm.
        grasp_force: Force of the fingers on what they close around [N].
        timeout: Seconds without an action after which the arm brakes, and holds.
        cameras: LeRobot's cameras by name.
    """

    address: str
    arm: str = "fr3"
    units: str = "deg"
    gripper: bool = True
    speed: float = 0.2
    collision_torque: float = 40.0
    collision_force: float = 40.0
    grasp_force: float = 20.0
    timeout: float = 0.25
    cameras: dict[str, CameraConfig] = field(default_factory=dict)


@TeleoperatorConfig.register_subclass("er_il_franka_leader")
@dataclass(kw_only=True)
class FrankaLeaderConfig(TeleoperatorConfig):
    """A second Franka arm.

    Attributes:
        address: Network address of its control box.
        arm: ``fr3`` or ``panda``: the follower's, whose joint names the actions carry.
        units: Of the joints' positions: ``deg`` or ``rad``. The gripper's opening is in [0, 1].
        gripper: The arm has a Franka Hand, whose opening the follower's hand mirrors.
    """

    address: str
    arm: str = "fr3"
    units: str = "deg"
    gripper: bool = True
