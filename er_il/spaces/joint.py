"""Joint space (paper III-B): the action is the joint angles."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.solver import LIMIT_MARGIN, Status
from er_il.spaces.base import ActionSpace, Array, Decoded


@dataclass(frozen=True, eq=False)
class JointSpace(ActionSpace):
    """The n joint angles [rad] and the gripper."""

    kind = "joint"

    @property
    def arm_names(self) -> tuple[str, ...]:
        return tuple(f"{joint}.pos" for joint in self.arm.joints)

    def _encode_arm(self, q: Array) -> Array:
        return q

    def _decode_arm(self, action: Vector, seed: Vector, current: Vector) -> Decoded:
        q = np.clip(action, self.arm.lower, self.arm.upper)
        inside = np.all(np.abs(q - action) <= LIMIT_MARGIN)
        return Decoded(q, 0.0, Status.OK if inside else Status.LIMIT)

    def _details(self) -> dict[str, Any]:
        return {}
