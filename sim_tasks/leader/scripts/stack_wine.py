"""The script that lays the bottle into the rack."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.stack_wine import RACK, StackWine

PITCH = np.radians(20)  # of the hand below the horizontal at the grasp; by so much it leans over at the rack
ASIDE = np.radians(50)  # of the hand's direction at the grasp from the robot's: the wrist is beside the hand
BACK = 0.10  # [m] via point, from the grasp back along the hand
LIFT, ABOVE = 0.12, 0.10  # [m] after the grasp, and before the bottle is let down
TURNED = 0.5  # share of the way to the rack that is left where the bottle lies level
CLOSED = 0.0
PACE = 0.35  # share of the script's speed where the hand moves far while the joints turn little
UPSIDE_DOWN = np.diag([-1.0, -1.0, 1.0, 1.0])  # the flange down, with the wrist above it


class StackWineLeader(MovesLeader[StackWine]):
    """The hand takes the bottle from the side, since its wrist would be in the bench from the front."""

    avoid = (RACK,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        point, seat = self._world.grasp_point, self._world.seat
        yaw = float(np.arctan2(point[1], point[0])) + ASIDE
        # The hand leans over with the bottle, around the line between its fingers: neck up becomes neck forward.
        neck = self._world.rotation(RACK)[:, 0]
        forward = float(np.arctan2(neck[1], neck[0]))

        def grasp(offset: np.ndarray) -> np.ndarray:
            return hand_pose(point + offset, PITCH, yaw) @ UPSIDE_DOWN

        def place(offset: np.ndarray) -> np.ndarray:
            return hand_pose(seat + offset, PITCH + np.pi / 2, forward) @ UPSIDE_DOWN

        above = np.array([0.0, 0.0, ABOVE])
        turned = above + TURNED * (point - seat) * (1.0, 1.0, 0.0)
        back = -BACK * grasp(np.zeros(3))[:3, 2] + self._draw_via(rng)
        return [
            Move([Keyframe(grasp(back), None)], 1.0),
            Move([Keyframe(grasp(np.zeros(3)), None, straight=True)], 1.0, pace=PACE),
            Move([Keyframe(grasp(np.array([0.0, 0.0, LIFT])), None, straight=True)], CLOSED, pace=PACE),
            Move([Keyframe(place(turned), None)], CLOSED),
            Move([Keyframe(place(above), None)], CLOSED, pace=PACE),
            Move([Keyframe(place(np.array([0.0, 0.0, 0.001])), None, straight=True)], CLOSED, pace=PACE),
            Move([], 1.0),
        ]
