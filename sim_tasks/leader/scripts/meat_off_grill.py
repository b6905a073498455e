"""The script that puts meat on the shelf."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import DOWN, hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.meat_off_grill import GRILL, MeatOffGrill
from sim_tasks.world.meat import GRASP_HEIGHT

ABOVE, LIFT = 0.10, 0.06  # [m] over the piece before the grasp; over grate and shelf while it is carried
UP = np.array([0.0, 0.0, 1.0])
GAP = 0.003  # [m] between shelf and piece when the fingers open


class MeatOffGrillLeader(MovesLeader[MeatOffGrill]):
    """From above, the fingers across the piece."""

    avoid = (GRILL, f"{GRILL}_lid")

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        forward = world.rotation(world.asked)[:, 0]
        yaw = float(np.arctan(forward[1] / forward[0]))  # the piece is as good from behind

        def hand(point: np.ndarray, height: float) -> np.ndarray:
            return hand_pose(point + height * UP, DOWN, yaw)

        piece = world.grasp_point.copy()
        shelf = world.point(GRILL, (*world.grill.shelf_centre, world.grill.shelf + GRASP_HEIGHT))
        via = hand(piece + self._draw_via(rng), ABOVE)
        return [
            Move([Keyframe(via, None), Keyframe(hand(piece, 0.0), None, straight=True)], 1.0),
            Move(
                [
                    Keyframe(hand(piece, LIFT), None, straight=True),
                    Keyframe(hand(shelf, LIFT), None, straight=True),
                    Keyframe(hand(shelf, GAP), None, straight=True),
                ],
                0.0,
                pace=0.7,
            ),
            Move([Keyframe(hand(shelf, ABOVE), None, straight=True)], 1.0),
        ]
