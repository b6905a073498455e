"""Task space (paper III-A): the action is the end-effector pose; IK chooses the elbow."""

from dataclasses import dataclass

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.solver import IkResult
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace

POSTURE_PULL = 0.05  # [rad] of the joint farthest from the posture; at 20 Hz, half a Panda's full speed


@dataclass(frozen=True, eq=False)
class TaskSpace(PoseSpace):
    """The end-effector pose alone.

    Where the arm is redundant, ``posture`` decides what IK does with the freedom: ``None`` takes
    the solution nearest the seed (minimal displacement), a posture (n,) [rad] one that is nearer to
    it than the seed, by at most ``POSTURE_PULL`` a decode: the null space then moves as a controller
    on a robot would move it, not by a jump.
    """

    posture: Vector | None = None

    kind = "task"

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        return ()

    def redundancy(self, q: Array) -> Array:
        return np.empty((len(q), 0))

    def solve(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> IkResult:
        if self.posture is None:
            return self.kinematics.solve(T_base_ee, seed)
        way = self.posture - seed
        share = min(1.0, POSTURE_PULL / max(float(np.max(np.abs(way))), POSTURE_PULL))
        return self.kinematics.solve(T_base_ee, seed, posture=seed + share * way)
