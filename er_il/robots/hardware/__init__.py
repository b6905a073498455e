"""Devices for LeRobot's stock commands: the robot that decodes, simulated arms, and Franka's.

``lerobot-teleoperate``, ``lerobot-record``, ``lerobot-replay`` and ``lerobot-rollout`` know them as
``--robot.type=er_il_arm``, ``--robot.type=er_il_sim`` with ``--teleop.type=er_il_scripted_leader``, and
``--robot.type=er_il_franka`` with ``--teleop.type=er_il_franka_leader``. LeRobot looks a device class up here by its
configuration's name, without ``Config``.
"""

from er_il.robots.hardware.decoding_config import DecodingRobotConfig
from er_il.robots.hardware.decoding_robot import DecodingRobot
from er_il.robots.hardware.follower import SimFollower, SimFollowerConfig
from er_il.robots.hardware.franka_config import FrankaFollowerConfig, FrankaLeaderConfig
from er_il.robots.hardware.franka_follower import FrankaFollower
from er_il.robots.hardware.franka_leader import FrankaLeader
from er_il.robots.hardware.leader import ScriptedLeader, ScriptedLeaderConfig

__all__ = [
    "DecodingRobot",
    "DecodingRobotConfig",
    "FrankaFollower",
    "FrankaFollowerConfig",
    "FrankaLeader",
    "FrankaLeaderConfig",
    "ScriptedLeader",
    "ScriptedLeaderConfig",
    "SimFollower",
    "SimFollowerConfig",
]
