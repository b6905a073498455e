"""Joint space (paper III-B): the action is the joint angles."""

from dataclasses import dataclass
from typing import Any

import array_api_compat as array_api
import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.batch import inside_limits
from er_il.kinematics.search import LIMIT_MARGIN
from er_il.kinematics.solver import IkResult, Status
from er_il.spaces.base import ArmSpace, Array

JOINT = "joint"


@dataclass(frozen=True, eq=False)
class JointSpace(ArmSpace):
    """The n joint angles [rad]."""

    @property
    def kind(self) -> str:
        return JOINT

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"{joint}.pos" for joint in self.arm.joints)

    def _encode(self, q: Array) -> Array:
        return q

    def _decode(self, action: Vector, seed: Vector, current: Vector) -> IkResult:
        q = self.arm.within_limits(action)
        inside = np.all(np.abs(q - action) <= LIMIT_MARGIN)
        return IkResult(q, Status.OK if inside else Status.LIMIT)

    def _solve_batch(self, actions: Any, seeds: Any) -> tuple[Any, Any]:
        xp = array_api.array_namespace(actions)
        return xp.asarray(actions, copy=True), inside_limits(self.arm, actions)

    def _details(self) -> dict[str, Any]:
        return {}
