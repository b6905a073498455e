"""The leader of two arms: each hand's way with the angle of its elbow, both arms moving together."""

from abc import ABC
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError
from sim_tasks.leader.collision import Collisions
from sim_tasks.leader.leader import RobotLeader
from sim_tasks.leader.motion import STRAIGHT_STEP, Segment
from sim_tasks.tasks.bimanual_task import BimanualTask
from sim_tasks.world.openarm import openarm_models, openarm_spec, root

TURN_STEP = 0.1  # [rad] by which an elbow turns between two waypoints


@dataclass(frozen=True)
class HandAndElbow:
    """A pose of a hand, and the arm angle."""

    T_base_ee: np.ndarray  # (4, 4)
    angle: float  # [rad]


class LeaderArms:
    """Two arms without obstacles that follow a script with their servos; their measured motion is the command."""

    def __init__(self, arms: Mapping[str, Arm], period: float) -> None:
        self._velocity = np.concatenate([arm.velocity for arm in arms.values()])
        self._period = period
        self._model = openarm_spec(arms).compile()
        self._robots = openarm_models(self._model, arms)
        self._substeps = round(period / self._model.opt.timestep)

    def perform(self, start: Vector, script: Sequence[Segment], speed: float) -> Iterator[np.ndarray]:
        """Play a script; yield each arm's joint angles [rad] and gripper opening each period.

        Args:
            start: Initial joint angles [rad], one arm after the other, as in the script.
            script: Consecutive segments; both grippers have the same opening.
            speed: Share of the joints' velocity limits that the fastest joint reaches.
        """
        data = mujoco.MjData(self._model)
        self._command(data, start, script[0].gripper, at_once=True)
        for segment in script:
            for target in segment.sample(self._velocity, self._period, speed):
                self._command(data, target, segment.gripper)
                mujoco.mj_step(self._model, data, nstep=self._substeps)
                yield np.concatenate(
                    [np.append(robot.joint_positions(data), segment.gripper) for robot in self._robots]
                )

    def _command(self, data: mujoco.MjData, q: Vector, opening: float, at_once: bool = False) -> None:
        for robot, angles in zip(self._robots, np.split(q, len(self._robots)), strict=True):
            (robot.place if at_once else robot.command)(data, angles, opening)


class BimanualLeader[Task: BimanualTask](RobotLeader[Task], ABC):
    """Demonstrates with two arms."""

    clearance = 0.005  # [m] that plans keep from obstacles

    def _leading(self) -> LeaderArms:
        return LeaderArms(self._world.arms, 1 / self._world.rate)

    def _collisions(self) -> Collisions:
        """Collision checks in the world as it is now."""
        world = self._world
        roots = [root(label) for label in world.arms]
        checks = Collisions(
            world.world_spec(), roots, lambda model: openarm_models(model, world.arms), world.obstacles, self.clearance
        )
        checks.copy(world.data)
        return checks

    def _path(self, start: Vector, goals: Sequence[Mapping[str, HandAndElbow]], checks: Collisions) -> np.ndarray:
        """Waypoints (K, n) [rad] of both arms from a start through goals, each hand on a straight line.

        Raises:
            PlanError: a hand cannot follow its line with that elbow, or something is in the way.
        """
        waypoints = [start]
        for goal in goals:
            now = dict(zip(self._world.arms, np.split(waypoints[-1], len(self._world.arms)), strict=True))
            lines = [_Line(arm, now[label], goal[label]) for label, arm in self._world.arms.items()]
            steps = max(line.steps for line in lines)
            waypoints += map(np.concatenate, zip(*(line.waypoints(steps) for line in lines), strict=True))
        if not all(map(checks.is_free, waypoints)):
            raise PlanError("The way is blocked.")
        # Solutions of IK differ in the last bits from machine to machine.
        return np.array(waypoints).round(12)


class _Line:
    """One hand's straight way, the elbow turning evenly the short way round."""

    def __init__(self, arm: Arm, start: Vector, goal: HandAndElbow) -> None:
        self._kinematics, self._redundancy = kinematics_of(arm), ArmAngle(arm)
        self._start, self._goal = start, goal
        self._T_start = self._kinematics.fk(start)
        before = float(self._redundancy.wrapped(start[None])[0])
        self._angle, self._turn = before, (goal.angle - before + np.pi) % (2 * np.pi) - np.pi
        way = float(np.linalg.norm(goal.T_base_ee[:3, 3] - self._T_start[:3, 3]))
        self.steps = max(1, int(np.ceil(max(way / STRAIGHT_STEP, abs(self._turn) / TURN_STEP))))

    def waypoints(self, steps: int) -> Iterator[Vector]:
        """The joint angles (n,) [rad] after each of so many steps."""
        T_start, T_goal, q = self._T_start, self._goal.T_base_ee, self._start
        rotation = Slerp([0, 1], Rotation.from_matrix([T_start[:3, :3], T_goal[:3, :3]]))
        for t in np.arange(1, steps + 1) / steps:
            T = np.eye(4)
            T[:3, :3] = rotation(t).as_matrix()
            T[:3, 3] = (1 - t) * T_start[:3, 3] + t * T_goal[:3, 3]
            ik = self._kinematics.solve(T, q, self._redundancy, [self._angle + t * self._turn])
            if ik.status is not Status.OK:
                raise PlanError("A hand cannot follow its line with that elbow.")
            q = ik.q
            yield q
