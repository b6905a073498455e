"""ERA (paper IV-B): the pose, and the arm angle of the elbow around the shoulder-wrist axis."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.kinematics.arm_angle import wrapped
from er_il.kinematics.solver import IkResult
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace


@dataclass(frozen=True, eq=False)
class EraSpace(PoseSpace):
    """The end-effector pose and the arm angle [rad], 0 where the elbow is highest.

    Along a trajectory the angle is unwrapped; the first takes the turn nearest to ``reference``.
    Decoding takes any turn. See :mod:`er_il.kinematics.arm_angle` for the geometry and where it has no meaning.
    """

    reference: float  # [rad]

    kind = "era"

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        return ("arm_angle",)

    def redundancy(self, q: Array) -> Array:
        angles = self.kinematics.arm_angle.along(q)
        unwrapped = np.unwrap(np.concatenate([[self.reference], angles]))[1:]
        return np.asarray(unwrapped, dtype=np.float64)[:, None]

    def conditioning(self, q: ArrayLike) -> float:
        return self.kinematics.conditioning(q, arm_angle=True)

    def change(self, start: Vector, end: Vector) -> Vector:
        return np.array([wrapped(turn) for turn in end - start])

    def solve(self, T_base_ee: Array, redundancy: Vector, seed: Vector) -> IkResult:
        return self.kinematics.solve(T_base_ee, seed, arm_angle=float(redundancy[0]))

    def _details(self) -> dict[str, Any]:
        frames = self.arm.angle_frames
        assert frames is not None  # without them there is no arm angle, hence no reference
        return {**super()._details(), "arm_angle": {**asdict(frames), "reference": self.reference}}
