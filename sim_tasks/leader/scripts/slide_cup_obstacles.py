"""The script of Slide Cup Obstacles."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.slide_cup_obstacles import COUNTER, MARK, SlideCupObstacles

PITCH = np.radians(50)  # of the hand below the horizontal
ASIDE, ABOVE = 0.03, 0.04  # [m] of the via point, from where the hand pushes
ELBOW, ELBOW_TURN = -0.13, 10.5  # [rad] of the base joint with the hand at y = 0, [rad/m] of its change along the shelf
NEARER = 0.008  # [m] that the tip is nearer to the robot than the cup's middle: there the cup does not turn out of its way
PUSH_STEP = 0.03  # [m] between the keyframes of the push
CLOSED = 0.0


class SlideCupObstaclesLeader(MovesLeader[SlideCupObstacles]):
    """The elbow swings to the right as the hand pushes to the left."""

    avoid = (COUNTER, *SlideCupObstacles.bottles)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        begin = self._world.push_point - [NEARER, 0.0, 0.0]
        end = begin + [0.0, self._world.position(MARK)[1] - self._world.position("cup")[1], 0.0]
        beside = begin - [0.0, ASIDE, 0.0]
        ways = np.linspace(begin, end, 1 + int(np.ceil((end[1] - begin[1]) / PUSH_STEP)))
        approach = [_keyframe(beside + [0.0, 0.0, ABOVE] + self._draw_via(rng), straight=True), _keyframe(beside, straight=True)]
        return [Move(approach, CLOSED), Move([_keyframe(way, straight=True) for way in ways], CLOSED, pace=0.6)]


def _keyframe(position: np.ndarray, straight: bool = False) -> Keyframe:
    return Keyframe(hand_pose(position, PITCH), ELBOW + ELBOW_TURN * float(position[1]), straight=straight)
