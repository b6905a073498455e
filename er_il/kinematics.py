"""Forward kinematics and inverse kinematics of an arm.

Forward kinematics is Pinocchio's; inverse kinematics iterates Placo's QP solver to a tolerance.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np
import pinocchio as pin  # pyright: ignore[reportMissingImports]
import placo  # pyright: ignore[reportMissingImports]
from numpy.typing import ArrayLike, NDArray

from er_il.arm import Arm, Vector
from er_il.errors import ShapeError, UnknownNameError

POSITION_TOLERANCE = 1e-4  # [m]
ROTATION_TOLERANCE = 1e-3  # [rad]
MAX_ITERATIONS = 50
DAMPING = 1e-6  # [1] weight of |dq|^2 against pose errors in m and rad: near-singular steps stay bounded
POSTURE_WEIGHT = 1e-2  # [1] weak against the pose: it acts on the null space
POSTURE_ITERATIONS = 30
POLISH = 1e-2  # solve to this share of the tolerance when it costs one more quadratic step
STALL = 1e-9  # [rad] a step this small changes nothing: stop early
LIMIT_MARGIN = 1e-4  # [rad] a joint this close to its limit is at it


class Status(StrEnum):
    """What became of a decoded action."""

    OK = "ok"
    INVALID = "invalid"  # not finite, or no rotation
    UNREACHABLE = "unreachable"  # the pose is out of reach with what is fixed
    LIMIT = "limit"  # a joint limit stands between the solution and the pose
    NOT_CONVERGED = "not_converged"  # still approaching when the iterations ran out
    JUMP = "jump"  # solved, but farther from the current posture than the arm moves in a period


@dataclass(frozen=True)
class IkResult:
    """Outcome of :meth:`Kinematics.solve`; ``q`` is the best effort whatever the status."""

    q: Vector  # (n,) [rad]
    status: Status
    pos_err: float  # [m]
    rot_err: float  # [rad]
    iters: int


class Kinematics:
    """Kinematics of one arm. Not thread-safe: one object a process (see :func:`kinematics_of`)."""

    def __init__(self, arm: Arm) -> None:
        self.arm = arm
        self._model = pin.buildModelFromXML(arm.model_xml)
        self._data = self._model.createData()
        # The URDF may list joints in another order than the arm's vectors do.
        self._order = np.array([self._model.joints[self._model.getJointId(j)].idx_q for j in arm.joints])
        self._base = self._model.getFrameId(arm.base_frame)
        self._ee = self._model.getFrameId(arm.ee_frame)
        self._solvers: dict[tuple[frozenset[str], bool], _Solver] = {}
        self._robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, arm.model_xml)
        # Placo keeps the floating base's 7 numbers in front of the joints.
        self._placo_order = np.array([self._robot.get_joint_offset(j) for j in arm.joints])
        self._T_world_base = np.array(self._robot.get_T_world_frame(arm.base_frame))

    def fk(self, q: ArrayLike) -> NDArray[np.float64]:
        """End-effector pose ``T_base_ee`` (4, 4) at joint angles q (n,) [rad]."""
        return self.frame_pose(q, self.arm.ee_frame)

    def frame_pose(self, q: ArrayLike, frame: str) -> NDArray[np.float64]:
        """Pose ``T_base_frame`` (4, 4) of any link at joint angles q (n,) [rad]."""
        pin.forwardKinematics(self._model, self._data, self._model_q(q))
        base = pin.updateFramePlacement(self._model, self._data, self._base)
        return base.actInv(pin.updateFramePlacement(self._model, self._data, self._frame_id(frame))).homogeneous

    def fk_batch(self, q: ArrayLike, frame: str | None = None) -> NDArray[np.float64]:
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

    def jacobian(self, q: ArrayLike) -> NDArray[np.float64]:
        """Geometric Jacobian (6, n) of the end effector: linear rows [m/rad] first, world-aligned."""
        full = pin.computeFrameJacobian(
            self._model, self._data, self._model_q(q), self._ee, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        return full[:, self._order]

    def solve(
        self,
        T_base_ee: ArrayLike,
        seed: ArrayLike,
        fixed: Mapping[str, float] | None = None,
        posture: ArrayLike | None = None,
    ) -> IkResult:
        """Find joint angles that reach a pose, starting from a seed.

        Without ``posture`` the iterations move as little as they need to: of all solutions the
        one near the seed. With it, the null space is first pulled towards that posture; the last
        iterations drop the pull, so that the pose is met as exactly as without.

        Args:
            T_base_ee: (4, 4) target pose.
            seed: (n,) [rad] start of the iterations; clipped to the limits.
            fixed: Joints that keep a given angle [rad] (ERJ's commanded joints). An angle outside
                its limits is clipped and reported as ``Status.LIMIT``.
            posture: (n,) [rad] preferred configuration in the null space.
        """
        arm = self.arm
        fixed = dict(fixed or {})
        q = np.clip(self._checked(seed), arm.lower, arm.upper)
        clipped = False
        for joint, angle in fixed.items():
            if joint not in arm.joints:
                raise UnknownNameError("joint", joint, arm.joints)
            i = arm.joints.index(joint)
            q[i] = np.clip(angle, arm.lower[i], arm.upper[i])
            clipped |= abs(q[i] - angle) > LIMIT_MARGIN
        target = np.asarray(T_base_ee, dtype=np.float64)
        iters = 0
        if posture is not None:
            q, iters, _ = self._iterate(
                target, q, fixed, self._checked(posture), POSTURE_ITERATIONS, stop_at_pose=False
            )
        q, more, moving = self._iterate(target, q, fixed, None, MAX_ITERATIONS, stop_at_pose=True)
        pos_err, rot_err = self.pose_error(target, q)
        reached = pos_err <= POSITION_TOLERANCE and rot_err <= ROTATION_TOLERANCE
        if clipped:
            status = Status.LIMIT
        elif reached:
            status = Status.OK
        else:
            status = self._why_not(q, fixed, moving)
        return IkResult(q, status, pos_err, rot_err, iters + more)

    def pose_error(self, T_base_ee: NDArray[np.float64], q: ArrayLike) -> tuple[float, float]:
        """Distance [m] and angle [rad] between a target pose and the pose at q."""
        T = self.fk(q)
        angle = np.linalg.norm(pin.log3(T[:3, :3].T @ T_base_ee[:3, :3]))
        return float(np.linalg.norm(T_base_ee[:3, 3] - T[:3, 3])), float(angle)

    def _iterate(
        self,
        target: NDArray[np.float64],
        q: Vector,
        fixed: Mapping[str, float],
        posture: Vector | None,
        limit: int,
        *,
        stop_at_pose: bool,
    ) -> tuple[Vector, int, bool]:
        """Run QP steps from q; returns the angles, the steps taken, and whether it was still moving."""
        solver = self._solver(frozenset(fixed), posture is not None)
        solver.aim(self._T_world_base @ target, posture, self.arm.joints)
        robot = self._robot
        state = np.array(robot.state.q)
        state[self._placo_order] = q
        robot.state.q = state
        robot.update_kinematics()  # the solver linearises around the robot's last kinematics
        for step in range(limit):
            if stop_at_pose:
                pos_err, rot_err = self.pose_error(target, q)
                if pos_err <= POLISH * POSITION_TOLERANCE and rot_err <= POLISH * ROTATION_TOLERANCE:
                    return q, step, True
            try:
                solver.step()
            except RuntimeError:  # the QP has no solution: keep the last angles, the caller sees the error
                return q, step, False
            robot.update_kinematics()
            moved = np.array(robot.state.q)[self._placo_order]
            moved = np.clip(moved, self.arm.lower, self.arm.upper)  # the QP keeps limits to its own tolerance
            largest = float(np.max(np.abs(moved - q)))
            q = moved
            if largest < STALL:
                return q, step + 1, False
        return q, limit, True

    def _why_not(self, q: Vector, fixed: Mapping[str, float], moving: bool) -> Status:
        free = np.array([joint not in fixed for joint in self.arm.joints])
        at_limit = (q - self.arm.lower < LIMIT_MARGIN) | (self.arm.upper - q < LIMIT_MARGIN)
        if np.any(at_limit & free):
            return Status.LIMIT
        return Status.NOT_CONVERGED if moving else Status.UNREACHABLE

    def _solver(self, fixed: frozenset[str], with_posture: bool) -> "_Solver":
        key = (fixed, with_posture)
        if key not in self._solvers:
            self._solvers[key] = _Solver(self._robot, self.arm, fixed, with_posture)
        return self._solvers[key]

    def _frame_id(self, frame: str) -> int:
        if not self._model.existFrame(frame):
            raise UnknownNameError("frame", frame, [f.name for f in self._model.frames])
        return self._model.getFrameId(frame)

    def _model_q(self, q: ArrayLike) -> Vector:
        full = np.zeros(self._model.nq)
        full[self._order] = self._checked(q)
        return full

    def _checked(self, q: ArrayLike) -> Vector:
        angles = np.asarray(q, dtype=np.float64)
        if angles.shape != (self.arm.dof,):
            raise ShapeError("Joint angles", angles.shape, f"({self.arm.dof},)")
        return angles


class _Solver:
    """A Placo QP for one set of fixed joints, built once and re-aimed for every target."""

    def __init__(self, robot: placo.RobotWrapper, arm: Arm, fixed: Iterable[str], with_posture: bool) -> None:
        self._qp = placo.KinematicsSolver(robot)
        self._qp.mask_fbase(True)
        self._qp.enable_joint_limits(True)
        for joint in fixed:
            self._qp.mask_dof(joint)
        self._pose = self._qp.add_frame_task(arm.ee_frame, np.eye(4))
        self._pose.configure("pose", "soft", 1.0, 1.0)
        self._posture = self._qp.add_joints_task() if with_posture else None
        if self._posture is not None:
            self._posture.configure("posture", "soft", POSTURE_WEIGHT)
        self._qp.add_regularization_task(DAMPING)

    def aim(self, T_world_ee: NDArray[np.float64], posture: Vector | None, joints: tuple[str, ...]) -> None:
        self._pose.T_world_frame = T_world_ee
        if self._posture is not None and posture is not None:
            self._posture.set_joints(dict(zip(joints, posture.tolist(), strict=True)))

    def step(self) -> None:
        self._qp.solve(True)


@lru_cache
def kinematics_of(arm: Arm) -> Kinematics:
    """The process's kinematics of an arm, built on first use."""
    return Kinematics(arm)
