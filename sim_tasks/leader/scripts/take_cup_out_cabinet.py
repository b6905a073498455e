"""The script that takes a cup out of a turned cabinet."""

from collections.abc import Sequence

import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.take_cup_out_cabinet import CABINET, GOAL, TakeCupOutCabinet

# The more the opening faces aside, the more level must the hand be, and the farther must the elbow swing out to the
# opening's side, or the forearm runs into the cabinet's top. Before a cabinet that faces the robot, the elbow keeps a
# little out of the hand's plane, in which the wrist would be at its limit.
TURNS = np.radians((0, 15, 60, 90))  # of the cabinet, either way
PITCHES = np.radians((12, 11, 7, 4))  # of the hand below the horizontal
ELBOWS = (-0.3, -0.3, 1.0, 1.8)  # [rad] of the base joint, which turns away from where the elbow swings
LEAN = 0.1  # [rad] of a joint below the base joint, if the arm has one
EASE = 0.8  # yaw of the hand, as a share of the cabinet's turn
BEFORE = 0.18  # [m] from the cup to the hand before the opening
AROUND = 0.10  # [m] by which the hand gives the corner of a cabinet that is turned by a right angle a wide berth
LIFT = np.array([0.0, 0.0, 0.02])  # [m]


class TakeCupOutCabinetLeader(MovesLeader[TakeCupOutCabinet]):
    """Round the corner, in through the opening, and out the same way."""

    avoid = (CABINET,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        cup, goal, inwards = world.grasp_point.copy(), world.position(GOAL), world.rotation(CABINET)[:, 0]
        turn = float(np.arctan2(inwards[1], inwards[0]))
        pitch, yaw = np.interp(abs(turn), TURNS, PITCHES), EASE * turn
        side = np.sign(yaw - np.arctan2(cup[1], cup[0]))
        elbow = float(side * np.interp(abs(turn), TURNS, ELBOWS))

        def at(point: Vector, share: float = 1.0) -> Keyframe:
            """The hand at a point, turned by a share of what it takes inside."""
            return Keyframe(hand_pose(point, pitch, share * yaw), share * elbow, straight=True, lean=LEAN)

        before = cup - BEFORE * inwards
        via = (world.tip + before) / 2 - AROUND * abs(np.sin(turn)) * inwards + self._draw_via(rng)
        return [Move([at(via, 0.5), at(before), at(cup)], 1.0), Move([at(cup + LIFT), at(goal)], 0.0)]
