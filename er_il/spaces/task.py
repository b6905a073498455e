"""Task space (paper III-A): the action is the end-effector pose; IK chooses the elbow."""

from dataclasses import dataclass

import numpy as np

from er_il.arm import Vector
from er_il.kinematics import IkResult
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace


@dataclass(frozen=True, eq=False)
class TaskSpace(PoseSpace):
    """The end-effector pose alone.

    Where the arm is redundant, ``posture`` decides what IK does with the freedom: ``None`` takes
    the solution nearest the seed (minimal displacement), a posture (n,) [rad] the one nearest to it.
    """

    posture: Vector | None = None

    kind = "task"

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        return ()

    def redundancy(self, q: Array) -> Array:
        return np.empty((len(q), 0))

    def solve(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> IkResult:
        return self.kinematics.solve(T_base_ee, seed, posture=self.posture)
