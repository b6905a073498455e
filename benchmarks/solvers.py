"""Inverse kinematics that comes with er_il: its action spaces, LeRobot's class, and a bare loop around Placo.

Every solver is given the same targets: an end-effector pose in the arm's base frame, which has to be the root of its
URDF, and the values of the redundancy that the solver's action space commands, if it commands one.
"""

import math
from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
import placo
from lerobot.model import RobotKinematics
from numpy.typing import NDArray

from er_il import Arm, make_action_space
from er_il.arms.arm import Vector
from er_il.arms.urdf import generated_urdf

Array = NDArray[np.float64]

POSITION_TOLERANCE = 1e-4  # [m] a pose is met,
ROTATION_TOLERANCE = 1e-3  # [rad] and iterations that have no other rule stop
MAX_ITERATIONS = 50
DAMPING = 1e-8  # [1] of |dq|^2 in a program that would not be strictly convex without it


class Target(NamedTuple):
    """What is commanded: as an action of er_il, and as the parts that other libraries take."""

    action: Vector  # position [m], quaternion, redundancy values [rad], gripper
    T_base_ee: Array  # (4, 4)
    values: Vector  # (m,) [rad] of the redundancy


class Solution(NamedTuple):
    """What a solver found."""

    q: Vector  # (n,) [rad]
    iterations: int  # 0 of a closed form


class Solver(ABC):
    """Inverse kinematics of one arm.

    Args:
        arm: The arm.
        space: Name of the action space whose commands it solves: ``task`` for a pose alone.
    """

    name: str

    def __init__(self, arm: Arm, space: str) -> None:
        self.arm = arm
        self.kind = space
        self.space = make_action_space(space, arm)

    @property
    def commands(self) -> list[str]:
        """What it is given beside the pose: joints, or the arm angle."""
        return [name.removesuffix(".pos") for name in self.space.names[7:-1]]

    def target(self, q: Vector) -> Target:
        """The command that asks for joint angles q (n,) [rad]."""
        action = self.space.encode(q)
        return Target(action, self.space.fk(q), action[7:-1])

    @abstractmethod
    def solve(self, target: Target, seed: Vector) -> Solution:
        """Solve for a target from a seed (n,) [rad]."""

    def held(self) -> list[int]:
        """Indices of the joints whose angles are commanded."""
        return [self.arm.joints.index(joint) for joint in self.commands]

    def start(self, target: Target, seed: Vector) -> Vector:
        """The seed with the commanded joints at their angles."""
        q = np.array(seed)
        q[self.held()] = target.values
        return q


class ErIl(Solver):
    """An action space of er_il, as its users call it."""

    def __init__(self, arm: Arm, space: str) -> None:
        super().__init__(arm, space)
        self.name = f"er_il, {space.partition('@')[0].upper() if self.commands else 'task space'}"

    def solve(self, target: Target, seed: Vector) -> Solution:
        found = self.space.decode(target.action, seed)
        return Solution(found.q, found.iters)


class LeRobot(Solver):
    """LeRobot's class with its own weights, in degrees. It solves one program a call; iterated, until the pose is met.

    Forward kinematics comes first, as in LeRobot's pipelines: else it linearises at the last solution.
    """

    def __init__(self, arm: Arm, *, iterated: bool) -> None:
        super().__init__(arm, "task")
        self.name = f"LeRobot, {'iterated' if iterated else 'one call'}"
        self._calls = MAX_ITERATIONS if iterated else 1
        urdf = generated_urdf(arm.model_xml, arm.urdf.name)
        self._ik = RobotKinematics(str(urdf), arm.ee_frame, list(arm.joints))

    def solve(self, target: Target, seed: Vector) -> Solution:
        q = np.rad2deg(seed)
        T = self._ik.forward_kinematics(q)
        calls = 0
        while calls < self._calls and not is_met(target.T_base_ee, T):
            q = self._ik.inverse_kinematics(q, target.T_base_ee)
            T = self._ik.robot.get_T_world_frame(self._ik.target_frame_name)
            calls += 1
        return Solution(np.deg2rad(q), calls)


class BarePlaco(Solver):
    """The shortest loop around Placo: joint limits, commanded joints masked, the tasks' own errors to stop at.

    They are those before the last step, which makes the solution much more exact than the tolerance.
    """

    name = "Placo, bare loop"

    def __init__(self, arm: Arm, space: str) -> None:
        super().__init__(arm, space)
        self._robot = placo.RobotWrapper("", placo.Flags.ignore_collisions, arm.model_xml)
        self._order = np.array([self._robot.get_joint_offset(joint) for joint in arm.joints])
        self._program = placo.KinematicsSolver(self._robot)
        self._program.mask_fbase(True)
        self._program.enable_joint_limits(True)
        for joint in self.held():
            self._program.mask_dof(arm.joints[joint])
        self._pose = self._program.add_frame_task(arm.ee_frame, np.eye(4))
        self._pose.configure("pose", "soft", 1.0, 1.0)
        self._program.add_regularization_task(DAMPING)

    def solve(self, target: Target, seed: Vector) -> Solution:
        state = np.array(self._robot.state.q)
        state[self._order] = self.start(target, seed)
        self._robot.state.q = state
        self._robot.update_kinematics()
        self._pose.T_world_frame = target.T_base_ee
        position, orientation = self._pose.position(), self._pose.orientation()
        iterations = 0
        while iterations < MAX_ITERATIONS:
            try:
                self._program.solve(True)
            except RuntimeError:  # the program has no solution
                break
            self._robot.update_kinematics()
            iterations += 1
            if position.error_norm() <= POSITION_TOLERANCE and orientation.error_norm() <= ROTATION_TOLERANCE:
                break
        return Solution(self._robot.state.q[self._order], iterations)


def is_met(T_base_ee: Array, reached: Array) -> bool:
    """True if a pose (4, 4) is another within the tolerances."""
    gap = T_base_ee[:3, 3] - reached[:3, 3]
    cosine = 0.5 * (np.vdot(T_base_ee[:3, :3], reached[:3, :3]) - 1.0)
    return bool(gap @ gap <= POSITION_TOLERANCE**2 and cosine >= math.cos(ROTATION_TOLERANCE))


def own_solvers(arm: Arm) -> list[Solver]:
    """The solvers that need no further package."""
    spaces = ["task", "erj", f"erj@{arm.joints[-1]}", "era"]
    bare: list[Solver] = [BarePlaco(arm, space) for space in ("task", "erj")]
    return [*(ErIl(arm, space) for space in spaces), *bare, LeRobot(arm, iterated=False), LeRobot(arm, iterated=True)]
