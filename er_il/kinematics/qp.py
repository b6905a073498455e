"""The quadratic program behind inverse kinematics: one damped step towards a pose.

Each step minimises

    |J dq - e|^2 + posture_weight |q + dq - q_posture|^2 + damping |dq|^2

within the joint limits, over the joints that are not fixed.
"""

from collections.abc import Iterable

import numpy as np
import placo  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector

MIN_DAMPING = 1e-10  # [1] keeps the program strictly convex
MAX_STEP = 0.2  # [rad] longest joint step: the linearisation is not trusted farther
POSTURE_WEIGHT = 1e-2  # [1] weak against the pose: it acts on the null space
ANGLE_WEIGHT = 1.0  # [1] a length along the elbow's circle weighs as much as a position


class PoseQp:
    """A Placo program for one set of fixed joints, built once and re-aimed for every target."""

    def __init__(
        self, robot: placo.RobotWrapper, arm: Arm, fixed: Iterable[str], *, posture: bool, arm_angle: bool
    ) -> None:
        self._arm = arm
        self._robot = robot
        self._order = np.array([robot.get_joint_offset(joint) for joint in arm.joints])
        self._state = np.array(robot.state.q)
        self._T_world_base = np.array(robot.get_T_world_frame(arm.base_frame))
        self._program = placo.KinematicsSolver(robot)
        self._program.mask_fbase(True)
        self._program.enable_joint_limits(True)
        for joint in fixed:
            self._program.mask_dof(joint)
        self._pose = self._program.add_frame_task(arm.ee_frame, np.eye(4))
        self._pose.configure("pose", "soft", 1.0, 1.0)
        self._damping = self._program.add_regularization_task(MIN_DAMPING)
        self._posture = self._program.add_joints_task() if posture else None
        if self._posture is not None:
            self._posture.configure("posture", "soft", POSTURE_WEIGHT)
        self._rows = np.zeros((2, len(robot.state.q)))
        self._angle = None
        if arm_angle:  # one linear equation on the joints, written as two half-spaces
            self._angle = self._program.add_joint_space_half_spaces_constraint(self._rows, np.zeros(2))
            self._angle.configure("arm_angle", "soft", ANGLE_WEIGHT)

    def aim(self, T_base_ee: NDArray[np.float64], posture: Vector | None) -> None:
        """Set the target pose (4, 4) and the posture (n,) [rad]."""
        self._pose.T_world_frame = self._T_world_base @ T_base_ee
        if self._posture is not None and posture is not None:
            self._posture.set_joints(dict(zip(self._arm.joints, posture.tolist(), strict=True)))

    def step(self, q: Vector, damping: float, angle_row: tuple[Vector, float] | None = None) -> Vector:
        """Return the angles (n,) [rad] one step from q.

        Args:
            q: (n,) [rad] start of the step.
            damping: Weight of |dq|^2.
            angle_row: A linear equation row (n,) dq = change, for the arm angle.

        Raises:
            RuntimeError: the program has no solution.
        """
        arm = self._arm
        self._state[self._order] = q
        self._robot.state.q = self._state
        self._robot.update_kinematics()  # the program linearises around the robot's last kinematics
        self._damping.configure("damping", "soft", MIN_DAMPING + damping)
        if self._angle is not None and angle_row is not None:
            gradient, change = angle_row
            self._rows[0, self._order] = gradient
            self._rows[1, self._order] = -gradient
            goal = float(gradient @ q) + change
            self._angle.A, self._angle.b = self._rows, np.array([goal, -goal])
        # The floating base has one number fewer in a velocity than in a configuration.
        dq = self._program.solve(False)[self._order - 1]
        longest = float(np.abs(dq).max())
        if longest > MAX_STEP:
            dq = dq * (MAX_STEP / longest)
        return np.minimum(np.maximum(q + dq, arm.lower), arm.upper)  # the program keeps limits to its own tolerance
