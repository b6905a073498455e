"""Forward kinematics of an arm: poses and Jacobians of its links, by Pinocchio."""

import itertools
import math
from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.chain import Chain, Mounted, Placement, chunks
from er_il.kinematics.components import Components, cross
from er_il.support.errors import ShapeError, UnknownNameError

Array = NDArray[np.float64]
ASIDE = 1e-3  # [m] joints nearer than this are at the same place
AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Points(NamedTuple):
    """Origins of k links at one configuration."""

    origins: list[Components]  # [m] in the base frame
    jacobian: Array  # (6, n) spatial Jacobian of the joints at the base's origin
    moves: Array  # (k, n) 1 where a joint moves a link

    def slope(self, weights: Sequence[Components]) -> Vector:
        """Derivative (n,) of the sum of weights times the origins by the joints, the weights held."""
        wrenches = [(*weight, *cross(p, weight)) for p, weight in zip(self.origins, weights, strict=True)]
        return ((np.array(wrenches) @ self.jacobian) * self.moves).sum(axis=0)


class ForwardKinematics:
    """Forward kinematics of one arm. Not thread-safe: one object a process."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._model = pin.buildModelFromXML(arm.model_xml)
        self._data = self._model.createData()
        # The URDF may list joints in another order than the arm's vectors do.
        self._order = np.array([self._model.joints[self._model.getJointId(j)].idx_q for j in arm.joints])
        pin.framesForwardKinematics(self._model, self._data, np.zeros(self._model.nq))
        # Constant: the model fixes every joint outside the arm.
        self._base = self._model.getFrameId(arm.base_frame)
        self._T_base_world = self._data.oMf[self._base].inverse()
        self._ee = self._model.getFrameId(arm.ee_frame)
        self._mounted: dict[int, Mounted] = {}
        self._known: dict[tuple[str, ...], tuple[list[int], Array]] = {}
        self._ids = {frame.name: index for index, frame in reversed(list(enumerate(self._model.frames)))}
        self._at_origin = self._T_base_world.isIdentity()

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
        link = self.mounted(frame)
        poses = np.zeros((len(angles), 4, 4))
        poses[:, 3, 3] = 1.0
        for rows in chunks(len(angles)):
            R, p = self.chain.walk(angles[rows]).pose(link)
            poses[rows, :3, :3], poses[rows, :3, 3] = R.transpose(2, 0, 1), p.T
        return poses

    def rigid_to(self, frame: str) -> dict[str, Array]:
        """Poses ``T_frame_link`` (4, 4) of a link itself, then of all that no joint of the arm moves against it."""
        model, data = self._model, self._data
        index = self._frame_id(frame)
        pin.framesForwardKinematics(model, data, np.zeros(model.nq))
        found = {frame: np.eye(4)}
        for other, each in enumerate(model.frames):
            if each.type == pin.FrameType.BODY and each.parentJoint == model.frames[index].parentJoint:
                found.setdefault(each.name, data.oMf[index].actInv(data.oMf[other]).homogeneous)
        return found

    def positions(self, q: Array, frames: Sequence[str]) -> list[Components]:
        """Origins of links [m] in the base frame at q (N, n) [rad]: for each its components (N,)."""
        points = np.empty((len(frames), 3, len(q)))
        links = [self.mounted(frame) for frame in frames]
        for rows in chunks(len(q)):
            walk = self.chain.walk(q[rows])
            for point, link in zip(points, links, strict=True):
                point[:, rows] = walk.point(link)
        return [tuple(point) for point in points]

    def jacobians(self, q: Array) -> Array:
        """Geometric Jacobians (N, 6, n) of the end effector at q (N, n) [rad]; see :meth:`jacobian`."""
        jacobians = np.empty((len(q), 6, self.arm.dof))
        for rows in chunks(len(q)):
            jacobians[rows] = self.chain.walk(q[rows]).jacobian(self.mounted()).transpose(2, 0, 1)
        return jacobians

    @cached_property
    def chain(self) -> Chain:
        """The joints between base and end effector, for many configurations at once."""
        placements = [before.actInv(after) for before, after in itertools.pairwise(self._at_zero)]
        return Chain(tuple(self._chain_order), tuple(Placement(each.rotation, each.translation) for each in placements))

    def mounted(self, frame: str | None = None) -> Mounted:
        """A link's frame on the chain, the end effector's if omitted."""
        index = self._ee if frame is None else self._frame_id(frame)
        if index not in self._mounted:
            model, data = self._model, self._data
            joints = len(set(self._chain) & set(model.supports[model.frames[index].parentJoint]))
            pin.framesForwardKinematics(model, data, np.zeros(model.nq))
            placement = self._at_zero[joints].actInv(self._T_base_world * data.oMf[index])
            self._mounted[index] = Mounted(joints, Placement(placement.rotation, placement.translation))
        return self._mounted[index]

    @cached_property
    def _at_zero(self) -> list[pin.SE3]:
        """Placements in the base frame of the base and the chain's joints, all at zero, each z along the axis."""
        q = np.zeros(self.arm.dof)
        axes = self.jacobian(q)[3:].T
        pin.forwardKinematics(self._model, self._data, self._model_q(q))
        placements = [pin.SE3.Identity()]
        for index, joint in zip(self._chain_order, self._chain, strict=True):
            z = axes[index]
            x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
            x /= np.linalg.norm(x)
            R = np.column_stack([x, np.cross(z, x), z])
            placements.append(pin.SE3(R, self._T_base_world.act(self._data.oMi[joint].translation)))
        return placements

    @cached_property
    def _chain_order(self) -> list[int]:
        """Index in the arm's vectors of each joint of the chain."""
        return [self.arm.joints.index(self._model.names[joint]) for joint in self._chain]

    def jacobian(self, q: ArrayLike, frame: str | None = None) -> Array:
        """Geometric Jacobian (6, n) of a link, the end effector if omitted, in the base frame's axes.

        Linear rows [m/rad] first, then angular rows [rad/rad].
        """
        target = self._ee if frame is None else self._frame_id(frame)
        full = pin.computeFrameJacobian(self._model, self._data, self._model_q(self._checked(q)), target, AXES)
        return (self._T_base_world.rotation @ full[:, self._order].reshape(2, 3, -1)).reshape(6, -1)

    def pose_error(self, T_base_ee: Array, q: ArrayLike) -> tuple[float, float]:
        """Distance [m] and angle [rad] between a target pose and the pose at q."""
        T = self.fk(q)
        gap = T_base_ee[:3, 3] - T[:3, 3]
        return math.sqrt(gap @ gap), _rotation_angle(T[:3, :3].T @ T_base_ee[:3, :3])

    def pose_gap(self, T_base_ee: Array, q: Vector) -> Vector:
        """Translation [m] and rotation vector [rad] (6,) to a target pose from that at q (n,), in the base's axes."""
        T = self._placement(q, self._ee)
        gap = np.empty(6)
        gap[:3] = T_base_ee[:3, 3] - T.translation
        gap[3:] = pin.log3(T_base_ee[:3, :3] @ T.rotation.T)
        return gap

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
        q = np.zeros(self.arm.dof)
        axes = self.jacobian(q)[3:].T
        pin.framesForwardKinematics(self._model, self._data, self._model_q(q))
        T_base_world = self._T_base_world
        ends = [np.zeros(3), T_base_world.act(self._data.oMf[self._ee].translation)]
        origins = [T_base_world.act(self._data.oMi[joint].translation) for joint in self._chain]
        points = [ends[0], *origins, ends[1]]
        twisting = np.empty(self.arm.dof, dtype=bool)
        for at, i in enumerate(self._chain_order):
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
        centre = self._T_base_world.act(data.oMi[first].translation)
        return centre, float(sum(np.linalg.norm(length) for length in lengths))  # pyrefly: ignore[no-matching-overload]

    def points(self, q: Vector, frames: tuple[str, ...]) -> "Points":
        """Origins of links in the base frame at q (n,) [rad], and what their derivatives take."""
        model, data = self._model, self._data
        J = pin.computeJointJacobians(model, data, self._model_q(q))
        ids, moves = self._links(frames)
        origins = [pin.updateFramePlacement(model, data, index).translation for index in ids]
        if not self._at_origin:
            origins = [self._T_base_world.act(origin) for origin in origins]
            J = self._T_base_world.action @ J
        return Points([tuple(origin.tolist()) for origin in origins], J[:, self._order], moves)

    def _links(self, frames: tuple[str, ...]) -> tuple[list[int], Array]:
        """Indices of links, and masks (k, n) of the joints that move them."""
        if frames not in self._known:
            ids = [self._frame_id(frame) for frame in frames]
            moves = np.zeros((len(ids), self._model.njoints))
            for row, index in zip(moves, ids, strict=True):
                row[list(self._model.supports[self._model.frames[index].parentJoint])] = 1.0
            self._known[frames] = ids, moves[:, 1:][:, self._order]
        return self._known[frames]

    def _pose(self, q: Vector, frame: int) -> Array:
        return self._placement(q, frame).homogeneous

    def _placement(self, q: Vector, frame: int) -> pin.SE3:
        """``T_base_frame`` at q (n,) [rad]."""
        pin.forwardKinematics(self._model, self._data, self._model_q(q))
        return self._T_base_world * pin.updateFramePlacement(self._model, self._data, frame)

    def _frame_id(self, frame: str) -> int:
        if frame not in self._ids:
            raise UnknownNameError("frame", frame, [f.name for f in self._model.frames])
        return self._ids[frame]

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
