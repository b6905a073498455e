"""The quadratic program behind inverse kinematics: one damped step towards a pose.

Each step minimises

    |J dq - e|^2 + |D dq - d|^2 + posture_weight |q + dq - q_posture|^2 + damping |dq|^2

within the joint limits, over the joints that are not held. D dq = d are the linear equations of a redundancy.
"""

from collections.abc import Iterable

import numpy as np
import placo
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.task_order import in_order

Array = NDArray[np.float64]

MIN_DAMPING = 1e-10  # [1] keeps the program strictly convex
NO_DAMPING = 1e-12  # [1] so little more changes no step
MAX_STEP = 0.2  # [rad] longest joint step: the linearisation is not trusted farther
POSTURE_WEIGHT = 1e-2  # [1] weak against the pose: it acts on the null space
TASKS = ("pose_position", "pose_orientation", "regularization", "posture")  # as Placo names them
EQUATION_WEIGHT = 1.0  # [1] a redundancy's equations, scaled to lengths, weigh as much as a position


class PoseQp:
    """A Placo program for one set of held joints, built once and re-aimed for every target."""

    def __init__(
        self, robot: placo.RobotWrapper, arm: Arm, held: Iterable[int], *, posture: bool, equations: int
    ) -> None:
        """Build the program.

        Args:
            robot: The robot in Placo.
            arm: The arm.
            held: Indices of the joints that do not move.
            posture: True if the null space is pulled towards a posture.
            equations: Number of linear equations on the joints.
        """
        self._lower, self._upper = arm.lower, arm.upper
        self._joints = arm.joints
        self._robot = robot
        self._order = np.array([robot.get_joint_offset(joint) for joint in arm.joints])
        self._velocities = self._order - 1  # the floating base has one number fewer in a velocity
        self.free = np.setdiff1d(np.arange(arm.dof), list(held))  # indices of the joints that move
        self._free = self._velocities[self.free]
        self._state = np.array(robot.state.q)
        self._T_world_base = np.array(robot.get_T_world_frame(arm.base_frame))
        names = TASKS if posture else TASKS[:-1]
        self._program, tasks = in_order(lambda: _tasks(robot, arm.ee_frame, posture), names)
        self._pose, self._damping, self._posture = tasks
        self._position, self._orientation = self._pose.position(), self._pose.orientation()
        self._damped = 0.0  # the damping beyond the least that is configured
        self._program.mask_fbase(True)
        self._program.enable_joint_limits(True)
        for joint in held:
            self._program.mask_dof(arm.joints[joint])
        self._rows = np.zeros((2 * equations, len(self._state)))
        self._equations = None
        if equations:  # each written as two half-spaces
            self._equations = self._program.add_joint_space_half_spaces_constraint(self._rows, np.zeros(2 * equations))
            self._equations.configure("redundancy", "soft", EQUATION_WEIGHT)

    def aim(self, T_base_ee: Array, posture: Vector | None) -> None:
        """Set the target pose (4, 4) and the posture (n,) [rad]."""
        self._pose.T_world_frame = self._T_world_base @ T_base_ee
        if self._posture is not None and posture is not None:
            self._posture.set_joints(dict(zip(self._joints, posture.tolist(), strict=True)))

    def place(self, q: Vector) -> tuple[float, float]:
        """Put the robot at q (n,) [rad]; returns its distance [m] and angle [rad] from the target pose."""
        self._state[self._order] = q
        self._robot.state.q = self._state
        self._robot.update_kinematics()
        return self._errors()

    def advance(self, q: Vector, equations: tuple[Array, Vector] | None) -> tuple[float, float]:
        """Let the program itself move the robot by a step from q without more damping; returns as :meth:`place` does.

        Raises:
            RuntimeError: the program has no solution.
        """
        self._configure(0.0, q, equations)
        self._program.solve(True)
        self._robot.update_kinematics()
        return self._errors()

    def read(self) -> Vector:
        """Joint angles (n,) [rad] of the robot."""
        return np.array(self._robot.state.q).take(self._order)

    def _errors(self) -> tuple[float, float]:
        self._position.update()
        self._orientation.update()
        return self._position.error_norm(), self._orientation.error_norm()

    def derivative(self) -> Array:
        """Derivative (6, free joints) of the pose where the robot was placed, close to the target; in Placo's axes."""
        return np.concatenate([self._position.A, self._orientation.A]).take(self._free, axis=1)

    def gap(self) -> Vector:
        """Way (6,) [m and rad] to the target pose from where the robot was placed, in the same axes."""
        return np.concatenate([self._position.b, self._orientation.b])

    def step(self, q: Vector, damping: float, equations: tuple[Array, Vector] | None = None) -> Vector:
        """Return the angles (n,) [rad] one step from q, where the robot was placed last.

        Args:
            q: (n,) [rad] start of the step.
            damping: Weight of |dq|^2.
            equations: Matrix D (m, n) and right-hand side d (m,) of D dq = d, if the program has equations.

        Raises:
            RuntimeError: the program has no solution.
        """
        self._configure(damping if damping >= NO_DAMPING else 0.0, q, equations)
        dq = self._program.solve(False)[self._velocities]
        longest = max(map(abs, dq.tolist()))
        if longest > MAX_STEP:
            dq *= MAX_STEP / longest
        dq += q
        np.maximum(dq, self._lower, out=dq)  # the program keeps limits to its own tolerance
        return np.minimum(dq, self._upper, out=dq)

    def _configure(self, damping: float, q: Vector, equations: tuple[Array, Vector] | None) -> None:
        if damping != self._damped:
            self._damping.configure("damping", "soft", MIN_DAMPING + damping)
            self._damped = damping
        if self._equations is not None and equations is not None:
            matrix, change = equations
            m = len(change)
            self._rows[:m, self._order] = matrix
            self._rows[m:, self._order] = -matrix
            goal = matrix @ q + change
            self._equations.A, self._equations.b = self._rows, np.concatenate([goal, -goal])


def _tasks(
    robot: placo.RobotWrapper, frame: str, posture: bool
) -> tuple[placo.KinematicsSolver, tuple[placo.FrameTask, placo.RegularizationTask, placo.JointsTask | None]]:
    """A program with its tasks: the frame's pose, damping, and a posture if there is one."""
    program = placo.KinematicsSolver(robot)
    pose = program.add_frame_task(frame, np.eye(4))
    pose.configure("pose", "soft", 1.0, 1.0)
    damping = program.add_regularization_task(MIN_DAMPING)
    joints = program.add_joints_task() if posture else None
    if joints is not None:
        joints.configure("posture", "soft", POSTURE_WEIGHT)
    return program, (pose, damping, joints)
