"""Forward kinematics of an arm: poses and Jacobians of its links, by Pinocchio."""

import math
from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.support.errors import ShapeError, UnknownNameError

Array = NDArray[np.float64]
ASIDE = 1e-3  # [m] joints nearer than this are at the same place
AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class ForwardKinematics:
    """Forward kinematics of one arm. Not thread-safe: one object a process."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._model = pin.buildModelFromXML(arm.model_xml)
        self._data = self._model.createData()
        # The URDF may list joints in another order than the arm's vectors do.
        self._order = np.array([self._model.joints[self._model.getJointId(j)].idx_q for j in arm.joints])
        self._base = self._model.getFrameId(arm.base_frame)
        self._ee = self._model.getFrameId(arm.ee_frame)

    def fk(self, q: ArrayLike) -> Array:
        """End-effector pose ``T_base_ee`` (4, 4) at joint angles q (n,) [rad]."""
        return self._pose(self._checked(q), self._ee)

    def frame_pose(self, q: ArrayLike, frame: str) -> Array:
        """Pose ``T_base_frame`` (4, 4) of any link at joint angles q (n,) [rad]."""
        return self._pose(self._checked(q), self._frame_id(frame))

    def fk_batch(self, q: ArrayLike, frame: str | None = None) -> Array:
        """Poses ``T_base_frame`` (N, 4, 4) of a link, the end effector if omitted, at q (N, n) [rad]."""
        angles = np.asarray(q, dtype=np.float64)
        if angles.ndim != 2 or angles.shape[1] != self.arm.dof:
            raise ShapeError("Joint angles", angles.shape, f"(N, {self.arm.dof})")
        full = np.zeros((len(angles), self._model.nq))
        full[:, self._order] = angles
        target = self._ee if frame is None else self._frame_id(frame)
        poses = np.empty((len(angles), 4, 4))
        model, data, base = self._model, self._data, self._base
        for pose, angle in zip(poses, full, strict=True):
            pin.forwardKinematics(model, data, angle)
            T_world_base = pin.updateFramePlacement(model, data, base)
            pose[:] = T_world_base.actInv(pin.updateFramePlacement(model, data, target)).homogeneous
        return poses

    def jacobian(self, q: ArrayLike, frame: str | None = None) -> Array:
        """Geometric Jacobian (6, n) of a link, the end effector if omitted, in the base frame's axes.

        Linear rows [m/rad] first, then angular rows [rad/rad].
        """
        target = self._ee if frame is None else self._frame_id(frame)
        full = pin.computeFrameJacobian(self._model, self._data, self._model_q(self._checked(q)), target, AXES)
        R_base_world = pin.updateFramePlacement(self._model, self._data, self._base).rotation.T
        return (R_base_world @ full[:, self._order].reshape(2, 3, -1)).reshape(6, -1)

    def pose_error(self, T_base_ee: Array, q: ArrayLike) -> tuple[float, float]:
        """Distance [m] and angle [rad] between a target pose and the pose at q."""
        T = self.fk(q)
        gap = T_base_ee[:3, 3] - T[:3, 3]
        return math.sqrt(gap @ gap), _rotation_angle(T[:3, :3].T @ T_base_ee[:3, :3])

    def pose_gap(self, T_base_ee: Array, q: ArrayLike) -> Vector:
        """Translation [m] and rotation vector [rad] (6,) from the pose at q to a target pose, in the base's axes."""
        T = self.fk(q)
        return np.concatenate([T_base_ee[:3, 3] - T[:3, 3], pin.log3(T_base_ee[:3, :3] @ T[:3, :3].T)])

    def within_reach(self, position: Vector) -> bool:
        """True if a position (3,) [m] is no farther from the first joint than the stretched arm is long.

        Farther than that the end effector never gets, whatever the joint limits; nearer it may not either.
        """
        centre, radius = self._ball
        return float(np.linalg.norm(position - centre)) <= radius

    @cached_property
    def twisting(self) -> NDArray[np.bool_]:
        """Mask (n,) of the joints that twist the links they connect; the others bend the arm.

        A joint twists if the way from the joint before and to the one after (the base and the end
        effector at the ends) goes along its axis rather than across, all joints at zero. Joints at
        the same place, as in a shoulder, are passed over.
        """
        names = [self._model.names[joint] for joint in self._chain]
        order = sorted(range(len(self.arm.joints)), key=lambda i: names.index(self.arm.joints[i]))
        q = np.zeros(self.arm.dof)
        axes = self.jacobian(q)[3:].T
        pin.framesForwardKinematics(self._model, self._data, self._model_q(q))
        T_base_world = self._data.oMf[self._base].inverse()
        ends = [np.zeros(3), T_base_world.act(self._data.oMf[self._ee].translation)]
        origins = [T_base_world.act(self._data.oMi[joint].translation) for joint in self._chain]
        points = [ends[0], *origins, ends[1]]
        twisting = np.empty(self.arm.dof, dtype=bool)
        for at, i in enumerate(order):
            ways = [point - points[at + 1] for point in points]
            before = next((way for way in ways[at::-1] if np.linalg.norm(way) > ASIDE), ways[at])
            after = next((way for way in ways[at + 2 :] if np.linalg.norm(way) > ASIDE), ways[at + 2])
            links = np.array([before, after])
            along = np.abs(links @ axes[i])
            twisting[i] = along.sum() >= np.sqrt(np.maximum((links**2).sum(axis=1) - along**2, 0.0)).sum()
        return twisting

    @cached_property
    def _chain(self) -> list[int]:
        """Indices in the model of the joints between base and end effector, base first."""
        above_base = set(self._model.supports[self._model.frames[self._base].parentJoint])
        return [j for j in self._model.supports[self._model.frames[self._ee].parentJoint] if j not in above_base]

    @cached_property
    def _ball(self) -> tuple[Vector, float]:
        """First joint's origin (3,) [m] in the base frame, and the length [m] of all that follows, end to end."""
        model, data = self._model, self._data
        pin.framesForwardKinematics(model, data, np.zeros(model.nq))
        first, *others = self._chain
        lengths = [model.jointPlacements[joint].translation for joint in others]
        lengths.append(model.frames[self._ee].placement.translation)
        centre = data.oMf[self._base].actInv(data.oMi[first].translation)
        return centre, float(sum(np.linalg.norm(length) for length in lengths))

    def points(self, q: Vector, frames: Sequence[str]) -> tuple[Array, Array]:
        """Origins (k, 3) [m] of links in the base frame at q (n,) [rad], and their derivatives (k, 3, n)."""
        model, data = self._model, self._data
        pin.computeJointJacobians(model, data, self._model_q(q))
        T_world_base = pin.updateFramePlacement(model, data, self._base)
        R_base_world = T_world_base.rotation.T
        origins, slopes = [], []
        for frame in frames:
            index = self._frame_id(frame)
            origins.append(T_world_base.actInv(pin.updateFramePlacement(model, data, index).translation))
            slopes.append(R_base_world @ pin.getFrameJacobian(model, data, index, AXES)[:3, self._order])
        return np.array(origins), np.array(slopes)

    def _pose(self, q: Vector, frame: int) -> Array:
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, self._model_q(q))
        T_world_base = pin.updateFramePlacement(model, data, self._base)
        return T_world_base.actInv(pin.updateFramePlacement(model, data, frame)).homogeneous

    def _frame_id(self, frame: str) -> int:
        if not self._model.existFrame(frame):
            raise UnknownNameError("frame", frame, [f.name for f in self._model.frames])
        return self._model.getFrameId(frame)

    def _model_q(self, q: Vector) -> Vector:
        full = np.zeros(self._model.nq)
        full[self._order] = q
        return full

    def _checked(self, q: ArrayLike) -> Vector:
        angles = np.asarray(q, dtype=np.float64)
        if angles.shape != (self.arm.dof,):
            raise ShapeError("Joint angles", angles.shape, f"({self.arm.dof},)")
        return angles


@lru_cache
def forward_of(arm: Arm) -> ForwardKinematics:
    """The process's forward kinematics of an arm, built on first use."""
    return ForwardKinematics(arm)


def _rotation_angle(R: Array) -> float:
    """Angle [rad] of a rotation matrix (3, 3), exact to rounding for small angles too."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    return math.atan2(math.hypot(zy - yz, xz - zx, yx - xy), xx + yy + zz - 1.0)
