"""The script of Reach Elbow Pose."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError
from sim_tasks.leader.leader import REST, Leader
from sim_tasks.leader.motion import Segment
from sim_tasks.tasks.reach_elbow_pose import (
    ELBOW,
    ELBOW_GOAL,
    HAND_GOAL,
    POSTURE_DIGITS,
    REACHED,
    ReachElbowPose,
)

WAYPOINTS = 12


class ReachElbowPoseLeader(Leader[ReachElbowPose]):
    """Leads the hand on a straight line while the elbow swings out evenly.

    The plan is made of joint angles rather than of keyframes: with the elbow far out, one angle of the base joint
    belongs to two postures.
    """

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        world, kinematics = self._world, kinematics_of(self._world.arm)
        start = world.joint_positions
        T_start, T_goal = kinematics.fk(start), np.eye(4)
        T_goal[:3, :3], T_goal[:3, 3] = world.rotation(HAND_GOAL), world.position(HAND_GOAL)
        turn = Slerp([0, 1], Rotation.from_matrix([T_start[:3, :3], T_goal[:3, :3]]))
        path = [start]
        for t in np.arange(1, WAYPOINTS + 1) / WAYPOINTS:
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = turn(t).as_matrix(), (1 - t) * T_start[:3, 3] + t * T_goal[:3, 3]
            ik = kinematics.solve(T, (1 - t) * start + t * world.posture)
            if ik.status is not Status.OK:
                raise PlanError("The hand cannot follow the straight line to its goal.")
            path.append(ik.q)
        elbow = kinematics.frame_pose(path[-1], ELBOW)[:3, 3]
        if np.linalg.norm(elbow - world.position(ELBOW_GOAL)) > REACHED:
            raise PlanError("No posture is known in which hand and elbow are both at their goals.")
        # The elbow is free, and found a little differently from machine to machine.
        return [Segment(np.array(path).round(POSTURE_DIGITS), gripper=1.0, hold=REST)], self._draw_speed(rng)
