"""The simulated follower and the scripted leader as LeRobot hardware, for its stock commands.

``lerobot-teleoperate``, ``lerobot-record``, ``lerobot-replay`` and ``lerobot-rollout`` know them as
``--robot.type=er_il_sim`` and ``--teleop.type=er_il_scripted_leader``. LeRobot looks a device class
up here by its configuration's name, without ``Config``.
"""

from er_il.robots.hardware.follower import SimFollower, SimFollowerConfig
from er_il.robots.hardware.leader import ScriptedLeader, ScriptedLeaderConfig

__all__ = ["ScriptedLeader", "ScriptedLeaderConfig", "SimFollower", "SimFollowerConfig"]
