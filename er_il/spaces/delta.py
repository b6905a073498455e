"""Deltas (the paper's RL setting): the action is the change since the last command.

A pose changes as RLBench's does, by a translation along the base frame's axes and a rotation
applied from the left, R' = exp(w) R: rotations are composed, never subtracted. Joints, commanded
joints and arm angles change by differences; the gripper stays absolute.

The change of rotation is a rotation vector whatever the absolute space uses: within the bounds it
has no twin and no wrap, and its bound is a box.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.rotation import turn_by
from er_il.kinematics.solver import IkResult, Status
from er_il.spaces.base import ArmSpace, Array
from er_il.spaces.pose import PoseSpace
from er_il.support.errors import BoundsError

PREFIX = "delta_"  # of the space's name in a spec
POSE_NAMES = ("ee.dx", "ee.dy", "ee.dz", "ee.drx", "ee.dry", "ee.drz")
PERIOD = 0.05  # [s] of control, by which default bounds are chosen
TOLERANCE = 1e-6  # [1] share of a bound by which rounding to float32 may exceed it


@dataclass(frozen=True)
class DeltaBounds:
    """Largest change of one dimension in one step."""

    position: float = 0.1  # [m]
    rotation: float = 0.3  # [rad] of a component of the rotation vector; several joints turn the hand at once
    angle: float = 0.1  # [rad] of a joint or an arm angle

    @classmethod
    def of_arm(cls, arm: Arm) -> "DeltaBounds":
        """The default bounds of an arm: a joint changes by no more than the fastest one turns in ``PERIOD``."""
        return cls(angle=round(float(arm.velocity.max()) * PERIOD, 3))


@dataclass(frozen=True, eq=False)
class DeltaSpace(ArmSpace):
    """Changes of an absolute space's commands."""

    absolute: ArmSpace
    delta_bounds: DeltaBounds

    @property
    def kind(self) -> str:
        return PREFIX + self.absolute.kind

    @property
    def names(self) -> tuple[str, ...]:
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        if isinstance(self.absolute, PoseSpace):
            return (*POSE_NAMES, *_changes(self.absolute.redundancy_names))
        return _changes(self.absolute.names)

    @property
    def relative(self) -> bool:
        return True

    @cached_property
    def limits(self) -> Vector:
        """Largest magnitude (dim,) of each dimension [m or rad]."""
        bounds = self.delta_bounds
        if not isinstance(self.absolute, PoseSpace):
            return np.full(self.dim, bounds.angle)
        redundancy = [bounds.angle] * len(self.absolute.redundancy_names)
        return np.array([bounds.position] * 3 + [bounds.rotation] * 3 + redundancy)

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        return -self.limits, self.limits

    def conditioning(self, q: ArrayLike) -> float:
        return self.absolute.conditioning(q)

    def conditionings(self, q: Array) -> Vector:
        return self.absolute.conditionings(q)

    def ease(self, action: ArrayLike, seed: Vector, within: Vector, current: Vector) -> Vector | None:
        if not isinstance(self.absolute, PoseSpace):
            return None
        change = np.clip(np.asarray(action, dtype=np.float64), *self.bounds)
        return self.absolute.ease_pose(*self._target(self.absolute, change, current), seed, within)

    def _encode(self, q: Array) -> Array:
        space = self.absolute
        if isinstance(space, PoseSpace):
            shifts, turns = self._pose_changes(space.kinematics.fk_batch(q), q)
            changes = np.column_stack([shifts, turns.as_rotvec(), np.diff(space.redundancy_along(q), axis=0)])
        else:
            changes = np.diff(q, axis=0)
        excess = np.abs(changes) > self.limits * (1.0 + TOLERANCE)
        if np.any(excess):
            step, dimension = np.argwhere(excess)[0]
            raise BoundsError(
                f"Step {step + 1} changes {self.names[dimension]} by {changes[step, dimension]:.3g}; "
                f"the declared bound is {self.limits[dimension]:.3g}."
            )
        return np.vstack([np.zeros(self.dim), changes])

    def _pose_changes(self, T_base_ee: Array, q: Array) -> tuple[Array, Rotation]:
        """Translations (N-1, 3) [m] and rotations between the poses (N, 4, 4) of successive q (N, n) [rad]."""
        R = Rotation.from_matrix(T_base_ee[:, :3, :3])
        return np.diff(T_base_ee[:, :3, 3], axis=0), R[1:] * R[:-1].inv()

    def _decode(self, action: Vector, seed: Vector, current: Vector) -> IkResult:
        change = np.clip(action, *self.bounds)
        clipped = bool(np.any(np.abs(action) > self.limits * (1.0 + TOLERANCE)))
        space = self.absolute
        if isinstance(space, PoseSpace):
            decoded = space.solve(*self._target(space, change, current), current)
        else:
            decoded = space.decode(current + change, seed)
        return replace(decoded, status=Status.LIMIT) if clipped and decoded.status is Status.OK else decoded

    def _target(self, space: PoseSpace, change: Vector, current: Vector) -> tuple[Array, Vector]:
        """The pose (4, 4) and the redundancy values to which a change leads from the last command."""
        T_base_ee = self._start(space, change, current)
        T_base_ee[:3, 3] += change[:3]
        T_base_ee[:3, :3] = turn_by(change[3:6]) @ T_base_ee[:3, :3]
        return T_base_ee, space.redundancy_along(current[None])[0] + change[6:]

    def _start(self, space: PoseSpace, change: Vector, current: Vector) -> Array:
        """The pose (4, 4) from which the change of the pose counts."""
        return space.kinematics.fk(current)

    def _details(self) -> dict[str, Any]:
        return {**self.absolute._details(), "bounds": asdict(self.delta_bounds)}


def _changes(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{name.removesuffix('.pos')}.delta" for name in names)
