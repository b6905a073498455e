"""Redundancy-aware action spaces for robot imitation learning."""

from er_il.arm import Arm, ArmAngleFrames
from er_il.errors import ErIlError
from er_il.kinematics import Status
from er_il.spaces import ActionSpace, Decoded, from_spec, make_action_space

__all__ = ["ActionSpace", "Arm", "ArmAngleFrames", "Decoded", "ErIlError", "Status", "from_spec", "make_action_space"]
