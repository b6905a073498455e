"""Redundancy-aware action spaces for robot imitation learning."""

from er_il.arms.arm import Arm, ArmAngleFrames
from er_il.kinematics.solver import Status
from er_il.spaces import ActionSpace, Decoded, from_spec, make_action_space
from er_il.support.errors import ErIlError

__all__ = ["ActionSpace", "Arm", "ArmAngleFrames", "Decoded", "ErIlError", "Status", "from_spec", "make_action_space"]
