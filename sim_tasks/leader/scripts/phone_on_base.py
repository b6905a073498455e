"""The script that puts a phone on its base."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.leader.hand import DOWN, hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.phone_on_base import BASE, GRIP, PHONE, PhoneOnBase

ABOVE = np.array([0.0, 0.0, 0.10])  # [m] over the phone
BEFORE = 0.07  # [m] from the cradle, out of it
SEATED = 0.002  # [m] from which the phone is let go
CRADLE = 0.6  # pace into the cradle and out of it
SIDEWAYS = (0.36, 0.38)  # paces of reaching and carrying: the follower lags with the hand's speed


class PhoneOnBaseLeader(MovesLeader[PhoneOnBase]):
    """Fingers at the handset's sides, into the cradle at a right angle to its slope; any elbow would do."""

    avoid = (BASE, f"{BASE}_cradle")

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        grip, yaw = world.point(PHONE, GRIP), _azimuth(world.rotation(PHONE)[:, 0])
        rest = world.rest
        seat, out, base_yaw = rest[:3, 3] + rest[:3, :3] @ GRIP, rest[:3, 2], _azimuth(rest[:3, 0])
        pitch = DOWN + world.station.slope

        def grasp(offset: np.ndarray, straight: bool = False) -> Keyframe:
            return Keyframe(hand_pose(grip + offset, DOWN, yaw), _azimuth(grip), straight)

        def cradle(distance: float, straight: bool = True) -> Keyframe:
            return Keyframe(hand_pose(seat + distance * out, pitch, base_yaw), _azimuth(seat), straight)

        return [
            Move([grasp(ABOVE + self._draw_via(rng))], 1.0, pace=SIDEWAYS[0]),
            Move([grasp(np.zeros(3), straight=True)], 1.0),
            Move([grasp(ABOVE, straight=True)], 0.0),
            Move([cradle(BEFORE, straight=False)], 0.0, pace=SIDEWAYS[1]),
            Move([cradle(SEATED)], 0.0, pace=CRADLE),
            Move([cradle(BEFORE)], 1.0, pace=CRADLE),
        ]


def _azimuth(vector: np.ndarray) -> float:
    """Direction [rad] of a vector over the bench."""
    return float(np.arctan2(vector[1], vector[0]))
