"""ERJ (paper IV-C): the pose, and the angles of n-6 joints; IK solves the other six."""

from dataclasses import dataclass

from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.kinematics.solver import IkResult
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace


@dataclass(frozen=True, eq=False)
class ErjSpace(PoseSpace):
    """The end-effector pose and the angles [rad] of the arm's ``redundant`` joints."""

    kind = "erj"

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        return tuple(f"{joint}.pos" for joint in self.arm.redundant)

    def redundancy(self, q: Array) -> Array:
        return q[:, [self.arm.joints.index(joint) for joint in self.arm.redundant]]

    def conditioning(self, q: ArrayLike) -> float:
        return self.kinematics.conditioning(q, fixed=self.arm.redundant)

    def solve(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> IkResult:
        fixed = dict(zip(self.arm.redundant, redundancy.tolist(), strict=True))
        return self.kinematics.solve(T_base_ee, seed, fixed=fixed)
