"""Deltas (the paper's RL setting): the action is the change since the last command.

A pose changes as RLBench's does, by a translation along the base frame's axes and a rotation
applied from the left, R' = exp(w) R: rotations are composed, never subtracted. Joints, commanded
joints and arm angles change by differences; the gripper stays absolute.

The change of rotation is a rotation vector whatever the absolute space uses: within the bounds it
has no twin and no wrap, and its bound is a box.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Vector
from er_il.kinematics.solver import Status
from er_il.spaces.base import ActionSpace, Array, Decoded
from er_il.spaces.pose import PoseSpace
from er_il.support.errors import BoundsError, ShapeError

PREFIX = "delta_"  # of the space's name in a spec
POSE_NAMES = ("ee.dx", "ee.dy", "ee.dz", "ee.drx", "ee.dry", "ee.drz")
TOLERANCE = 1e-6  # [1] share of a bound by which rounding to float32 may exceed it


@dataclass(frozen=True)
class DeltaBounds:
    """Largest change of one dimension in one step."""

    position: float = 0.1  # [m]
    rotation: float = 0.3  # [rad] of a component of the rotation vector
    angle: float = 0.3  # [rad] of a joint or an arm angle


@dataclass(frozen=True, eq=False)
class DeltaSpace(ActionSpace):
    """Changes of an absolute space's commands."""

    absolute: ActionSpace
    bounds: DeltaBounds

    kind = "delta"

    @property
    def arm_names(self) -> tuple[str, ...]:
        if isinstance(self.absolute, PoseSpace):
            return (*POSE_NAMES, *_changes(self.absolute.redundancy_names))
        return _changes(self.absolute.arm_names)

    @property
    def limits(self) -> Vector:
        """Largest magnitude (dim - 1,) of each dimension that commands the arm [m or rad]."""
        bounds = self.bounds
        if not isinstance(self.absolute, PoseSpace):
            return np.full(self.dim - 1, bounds.angle)
        return np.array([bounds.position] * 3 + [bounds.rotation] * 3 + [bounds.angle] * (self.dim - 7))

    def encode(self, q: ArrayLike, gripper: ArrayLike = 1.0, start: ArrayLike | None = None) -> Array:
        """Encode commanded joint angles as changes.

        Args:
            q: (n,) [rad], or a trajectory (N, n) of consecutive commands.
            gripper: Opening in [0, 1], one value or (N,).
            start: (n,) [rad] command before the first; the first itself if omitted, so that its
                change is zero.

        Raises:
            BoundsError: a change is larger than the bounds, so that its decoding would not lead there.
        """
        if start is None:
            return super().encode(q, gripper)
        angles = np.asarray(q, dtype=np.float64)
        if np.shape(start) != (self.arm.dof,):
            raise ShapeError("The start", np.shape(start), f"({self.arm.dof},)")
        opening = np.broadcast_to(np.asarray(gripper, dtype=np.float64), len(np.atleast_2d(angles)))
        action = super().encode(np.vstack([start, angles]), np.concatenate([opening[:1], opening]))[1:]
        return action[0] if angles.ndim == 1 else action

    def _encode_arm(self, q: Array) -> Array:
        space = self.absolute
        if isinstance(space, PoseSpace):
            T_base_ee = self.kinematics.fk_batch(q)
            R = Rotation.from_matrix(T_base_ee[:, :3, :3])
            turns = (R[1:] * R[:-1].inv()).as_rotvec()
            changes = np.column_stack(
                [np.diff(T_base_ee[:, :3, 3], axis=0), turns, np.diff(space.redundancy(q), axis=0)]
            )
        else:
            changes = np.diff(q, axis=0)
        excess = np.abs(changes) > self.limits * (1.0 + TOLERANCE)
        if np.any(excess):
            step, dimension = np.argwhere(excess)[0]
            raise BoundsError(
                f"Step {step + 1} changes {self.names[dimension]} by {changes[step, dimension]:.3g}; "
                f"the declared bound is {self.limits[dimension]:.3g}."
            )
        return np.vstack([np.zeros(self.dim - 1), changes])

    def _decode_arm(self, action: Vector, seed: Vector, current: Vector) -> Decoded:
        change = np.clip(action, -self.limits, self.limits)
        clipped = bool(np.any(np.abs(action) > self.limits * (1.0 + TOLERANCE)))
        space = self.absolute
        if isinstance(space, PoseSpace):
            T_base_ee = self.kinematics.fk(current)
            T_base_ee[:3, 3] += change[:3]
            T_base_ee[:3, :3] = Rotation.from_rotvec(change[3:6]).as_matrix() @ T_base_ee[:3, :3]
            decoded = space.decode_pose(T_base_ee, space.redundancy(current[None])[0] + change[6:], seed)
        else:
            decoded = space.decode(np.append(current + change, 0.0), seed)
        if clipped and decoded.status is Status.OK:
            return Decoded(decoded.q, 0.0, Status.LIMIT, decoded.pos_err, decoded.rot_err, decoded.iters)
        return decoded

    def spec(self) -> dict[str, Any]:
        return {**super().spec(), "space": PREFIX + self.absolute.kind}

    def _details(self) -> dict[str, Any]:
        return {**self.absolute._details(), "bounds": asdict(self.bounds)}


def make_delta_space(absolute: ActionSpace, bounds: DeltaBounds | None = None) -> DeltaSpace:
    """Wrap an absolute space, so that actions are changes within ``bounds``."""
    return DeltaSpace(absolute.arm, absolute, bounds or DeltaBounds())


def _changes(names: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{name.removesuffix('.pos')}.delta" for name in names)
