"""The script that takes a cup out of a turned cabinet."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.take_cup_out_cabinet import CABINET, GOAL, TakeCupOutCabinet

PITCH = np.radians(12)  # of the hand below the horizontal before a cabinet that faces the robot
LEVEL = np.radians(8)  # by which it is more level before one that is turned by a right angle
EASE = 0.8  # yaw of the hand, as a share of the cabinet's turn
# Turn of the cabinet [rad], and angle [rad] of the base joint towards the side that it faces away from: the elbow
# swings out as the opening turns aside. Before a cabinet that faces the robot it leans to the other side a little,
# since in one plane with the hand the wrist would be at its limit.
TURNS, ELBOWS = (0.25, 1.05, 1.57), (-0.3, 1.0, 1.8)
BEFORE, AROUND = 0.18, 0.10  # [m] from the cup to the hand before the opening; by which it gives the corner a berth
LIFT = 0.02  # [m]


class TakeCupOutCabinetLeader(MovesLeader[TakeCupOutCabinet]):
    """In through the opening, and out the same way."""

    avoid = (CABINET,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        inwards = world.rotation(CABINET)[:, 0]
        turn = float(np.arctan2(inwards[1], inwards[0]))
        yaw, pitch = EASE * turn, PITCH - LEVEL * abs(turn) / (np.pi / 2)
        cup, goal = world.grasp_point.copy(), world.position(GOAL)
        aside = np.sign(yaw - np.arctan2(cup[1], cup[0]))
        elbow = float(aside * np.interp(abs(turn), TURNS, ELBOWS))
        before = cup - BEFORE * inwards
        via = (world.tip + before) / 2 - AROUND * abs(np.sin(turn)) * inwards + self._draw_via(rng)
        up = np.array([0.0, 0.0, LIFT])
        return [
            Move(
                [
                    Keyframe(hand_pose(via, pitch, yaw / 2), elbow / 2, straight=True),
                    Keyframe(hand_pose(before, pitch, yaw), elbow, straight=True),
                    Keyframe(hand_pose(cup, pitch, yaw), elbow, straight=True),
                ],
                1.0,
            ),
            Move(
                [
                    Keyframe(hand_pose(cup + up, pitch, yaw), elbow, straight=True),
                    Keyframe(hand_pose(goal, pitch, yaw), elbow, straight=True),
                ],
                0.0,
            ),
        ]
