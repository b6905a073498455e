"""The script of Serve Coffee Obstacles."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.serve_coffee_obstacles import (
    BOTTLES,
    COUNTER,
    GRASP,
    PLANTS,
    PLATE,
    WAYPOINT,
    ServeCoffeeObstacles,
)

PITCH = np.radians(65)  # of the hand below the horizontal
ABOVE = 0.08  # [m] of the via point, from the grasp
ELBOW, ELBOW_TURN = -0.1, 5.5  # [rad] of the base joint with the hand at y = 0, [rad/m] of its change across
SIDES = (-0.12, 0.0, 0.12)  # y [m] of the keyframes on the way across
DROP = 0.002  # [m] above the plate at which the mug is let go
OPEN, CLOSED = 1.0, 0.0


class ServeCoffeeObstaclesLeader(MovesLeader[ServeCoffeeObstacles]):
    """The elbow swings to the right as the hand carries the mug to the left."""

    avoid = (COUNTER, *BOTTLES, *PLANTS)
    clearance = 0.010

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        grasp = world.grasp_point
        above = grasp + np.array([0.0, 0.0, ABOVE])
        placed = world.position(PLATE) + np.array([0.0, 0.0, world.plate.height + DROP + GRASP[2]])
        carried = WAYPOINT[2] + world.shoulder_offset + GRASP[2]  # z [m] of the hand on the way across
        across = np.linspace(grasp[0], placed[0], 2 + len(SIDES))[1:-1]
        fetch = [_keyframe(above + self._draw_via(rng)), _keyframe(grasp, straight=True)]
        carry = [(grasp[0], grasp[1], carried), *((x, y, carried) for x, y in zip(across, SIDES, strict=True))]
        carry += [(placed[0], placed[1], carried), tuple(placed)]
        return [
            Move(fetch, OPEN),
            Move([_keyframe(np.array(point), straight=True) for point in carry], CLOSED),
            Move([], OPEN),
        ]


def _keyframe(position: np.ndarray, straight: bool = False) -> Keyframe:
    x, y, _ = position
    return Keyframe(hand_pose(position, PITCH, float(np.arctan2(y, x)) / 2), ELBOW + ELBOW_TURN * y, straight=straight)
