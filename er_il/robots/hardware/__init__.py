"""Devices for LeRobot's stock commands: the robot that decodes, the simulated follower and the scripted leader.

``lerobot-teleoperate``, ``lerobot-record``, ``lerobot-replay`` and ``lerobot-rollout`` know them as
``--robot.type=er_il_arm``, ``--robot.type=er_il_sim`` and ``--teleop.type=er_il_scripted_leader``. LeRobot looks a
device class up here by its configuration's name, without ``Config``.
"""

from er_il.robots.hardware.decoding_config import DecodingRobotConfig
from er_il.robots.hardware.decoding_robot import DecodingRobot
from er_il.robots.hardware.follower import SimFollower, SimFollowerConfig
from er_il.robots.hardware.leader import ScriptedLeader, ScriptedLeaderConfig

__all__ = [
    "DecodingRobot",
    "DecodingRobotConfig",
    "ScriptedLeader",
    "ScriptedLeaderConfig",
    "SimFollower",
    "SimFollowerConfig",
]
