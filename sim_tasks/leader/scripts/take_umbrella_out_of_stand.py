"""The script that takes the umbrella out of its stand."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.take_umbrella_out_of_stand import STAND, TakeUmbrellaOutOfStand

PITCH = np.radians(40)  # of the hand below the horizontal
BACK = 0.10  # [m] via point, from the grasp back along the hand
LIFT = 0.05  # [m] by which the tip ends above the rim
CLOSED = 0.0
PACE = 0.8  # share of the script's speed


class TakeUmbrellaOutOfStandLeader(MovesLeader[TakeUmbrellaOutOfStand]):
    """Any elbow will do."""

    avoid = (STAND,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        handle, stand = self._world.handle, self._world.stand
        yaw = float(np.arctan2(handle[1], handle[0]))
        grasp = hand_pose(handle, PITCH, yaw)
        via = hand_pose(handle - BACK * grasp[:3, 2] + self._draw_via(rng), PITCH, yaw)
        lifted = grasp.copy()
        lifted[2, 3] += stand.height - stand.floor + LIFT
        return [
            Move([Keyframe(via, None), Keyframe(grasp, None, straight=True)], 1.0, pace=PACE),
            Move([Keyframe(lifted, None, straight=True)], CLOSED, pace=PACE),
        ]
