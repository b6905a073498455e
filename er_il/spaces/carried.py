"""Carried deltas: the pose's target moves along with the commanded joints (the paper's published code).

A change of ERJ's joint also moves the target of the end effector as that joint alone would move it, before the pose's
own change is added; a change dv of ERX's coordinates W q as the joints' change W^T dv would. For the base joint the
action is then a yaw of the whole arm plus a change of the pose, always feasible for the other joints; in
:class:`er_il.spaces.delta.DeltaSpace`, the definition of the paper's text (section IV-C), the target stays when the
joint turns.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Vector
from er_il.kinematics.redundancy import LinearRedundancy
from er_il.spaces.base import Array
from er_il.spaces.delta import DeltaSpace
from er_il.spaces.pose import PoseSpace

CARRIED = "carried_"  # of the space's name in a spec


@dataclass(frozen=True, eq=False)
class CarriedDeltaSpace(DeltaSpace):
    """Changes of the commanded joints, which carry the hand, and of its pose; the absolute space is ERJ or ERX."""

    @property
    def kind(self) -> str:
        return CARRIED + self.absolute.kind

    @property
    def _commanded(self) -> LinearRedundancy:
        assert isinstance(self.absolute, PoseSpace) and isinstance(self.absolute.redundancy, LinearRedundancy)
        return self.absolute.redundancy

    def _pose_changes(self, T_base_ee: Array, q: Array) -> tuple[Array, Rotation]:
        carried = self._commanded.moved(q[:-1], np.diff(self._commanded.along(q), axis=0))
        T_carried = self.absolute.kinematics.fk_batch(carried)
        turns = Rotation.from_matrix(T_base_ee[1:, :3, :3]) * Rotation.from_matrix(T_carried[:, :3, :3]).inv()
        return T_base_ee[1:, :3, 3] - T_carried[:, :3, 3], turns

    def _start(self, space: PoseSpace, change: Vector, current: Vector) -> Array:
        return space.kinematics.fk(self._commanded.moved(current, change[6:]))
