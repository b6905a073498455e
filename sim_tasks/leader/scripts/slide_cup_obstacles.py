"""The script of Slide Cup Obstacles."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.slide_cup_obstacles import COUNTER, CUP, MARK, SlideCupObstacles

PITCH = np.radians(50)  # of the hand below the horizontal
ASIDE, ABOVE = 0.03, 0.04  # [m] of the via point, from where the hand pushes
ELBOW, ELBOW_TURN = -0.13, 10.5  # [rad] of the base joint with the hand at y = 0, [rad/m] of its change along the shelf
NEARER = 0.010  # [m] by which the tip is nearer to the robot than the cup's middle, which rolls aside otherwise
PUSH_STEP = 0.03  # [m] between the keyframes of the push
CLOSED = 0.0


class SlideCupObstaclesLeader(MovesLeader[SlideCupObstacles]):
    """The elbow swings to the right as the hand pushes to the left."""

    avoid = (COUNTER, *SlideCupObstacles.bottles)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        begin = world.push_point - np.array([NEARER, 0.0, 0.0])
        beside = begin - np.array([0.0, ASIDE, 0.0])
        via = beside + np.array([0.0, 0.0, ABOVE]) + self._draw_via(rng)
        way = float(world.position(MARK)[1] - world.position(CUP)[1])
        push = begin + np.linspace(0.0, way, 2 + int(abs(way) / PUSH_STEP))[:, None] * (0.0, 1.0, 0.0)
        approach = [_keyframe(via), _keyframe(beside)]
        return [Move(approach, CLOSED), Move([_keyframe(point) for point in push], CLOSED, pace=0.6)]


def _keyframe(position: np.ndarray) -> Keyframe:
    return Keyframe(hand_pose(position, PITCH), ELBOW + ELBOW_TURN * float(position[1]), straight=True)
