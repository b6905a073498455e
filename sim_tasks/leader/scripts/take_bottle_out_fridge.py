"""The script of Take Bottle Out Fridge."""

from collections.abc import Sequence

import numpy as np

from er_il.kinematics.solver import kinematics_of
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.moves import Move, MovesLeader
from sim_tasks.tasks.take_bottle_out_fridge import FRIDGE, MARK, TakeBottleOutFridge

PUSHED = 1.10  # [rad] base joint with which the forearm has the door well open
SWING = 12  # keyframes on the way there, all with the hand where it is
OUT = 0.30  # [rad] base joint with the bottle outside
BACK, LIFT = 0.13, 0.02  # [m] by which the bottle first moves straight out, and off the floor


class TakeBottleOutFridgeLeader(MovesLeader[TakeBottleOutFridge]):
    """Closes the fingers, swings the elbow over to the left with the hand still, then draws the hand back."""

    avoid = (FRIDGE,)

    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        world = self._world
        inside = kinematics_of(world.arm).fk(world.joint_positions)
        lifted, outside = inside.copy(), inside.copy()
        lifted[:3, 3] += (-BACK, 0.0, LIFT) + self._draw_via(rng)
        outside[:3, 3] = MARK
        outside[2, 3] += world.shoulder_offset
        elbow = world.arm.joints.index(world.arm.redundant[-1])
        swing = np.linspace(world.joint_positions[elbow], PUSHED, SWING + 1)[1:].tolist()
        return [
            Move([Keyframe(inside, angle) for angle in swing], 0.0),
            Move([Keyframe(lifted, PUSHED, straight=True), Keyframe(outside, OUT, straight=True)], 0.0),
        ]
