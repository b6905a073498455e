"""The script of Take Bottle Out Fridge."""

from collections.abc import Sequence

import numpy as np

from er_il.kinematics.solver import kinematics_of
from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.take_bottle_out_fridge import FRIDGE, TakeBottleOutFridge

PUSHED = 1.00  # [rad] base joint with which the forearm has the door well open
SWING = 12  # keyframes on the way there, all with the hand where it is
BACK, LIFT = 0.20, 0.02  # [m] by which the bottle then moves straight out, and off the floor
RETREAT = 0.90  # [rad] base joint there
OUT, PITCH = 0.60, np.radians(55)  # [rad] base joint at the mark; the hand below the horizontal
FORWARD, WAIT = 0.006, 0.2  # [m] by which the hand first moves along its axis, [s] before the fingers close
PACE, CARRY = 0.85, 0.45  # shares of the usual speed, until the bottle is out and from then on


class TakeBottleOutFridgeLeader(MovesLeader[TakeBottleOutFridge]):
    """Closes the fingers, swings the elbow over to the left with the hand still, then draws the hand back."""

    avoid = (FRIDGE,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        inside = kinematics_of(world.arm).fk(world.joint_positions)
        inside[:3, 3] += FORWARD * inside[:3, 2]
        lifted = inside.copy()
        lifted[:3, 3] += np.array([-BACK, 0.0, LIFT]) + self._draw_via(rng)
        outside = hand_pose(world.mark, PITCH)
        elbow = world.arm.joints.index(world.arm.redundant[-1])
        at_rest, *swing = np.linspace(world.joint_positions[elbow], PUSHED, SWING + 1).tolist()
        return [
            Move([Keyframe(inside, at_rest)], 1.0, pace=PACE, hold=WAIT),
            Move([Keyframe(inside, angle) for angle in swing], 0.0, pace=PACE),
            Move([Keyframe(lifted, RETREAT, straight=True)], 0.0, pace=PACE),
            Move([Keyframe(outside, OUT, straight=True)], 0.0, pace=CARRY),
        ]
