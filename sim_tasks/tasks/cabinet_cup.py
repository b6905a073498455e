"""The furniture of the paper's cup tasks: a cup in a deep cabinet before the robot, a wall behind it (paper V-B).

Two constraints make the elbow matter. The robot has its back to a wall: while the hand is outside the
cabinet, an elbow that points up leans back into the wall, so it must be swung out to the side. The
compartment is narrow: deep inside, an elbow swung out drives the forearm into the side wall, so it
must point up. It has to change while the hand is in the opening; no constant posture of
the elbow, and no preference for small changes, satisfies both.
"""

from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.cup_task import CUP, CupTask
from sim_tasks.tasks.placement import Area
from sim_tasks.world.props import Cabinet, Wall

OUTSIDE = 0.02  # [m] between the cabinet's front and the whole of a cup that is out
MARGIN = 0.05  # [m] that the hand is assumed to keep from the frame of the opening


class CabinetCup(CupTask):
    """A cup in the cabinet's depth."""

    cabinet = Cabinet()
    obstacles = ("cabinet", "wall")
    arms = ("panda", "panda8")
    surface = cabinet.floor
    centre = (0.72, 0.0)
    area = Area((cabinet.front, cabinet.front + cabinet.depth), (-cabinet.inner_width / 2, cabinet.inner_width / 2))

    def __init__(self, **kwargs: Any) -> None:
        """Build the task; for the arguments see :class:`CupTask`."""
        super().__init__(**kwargs)
        cabinet = self.cabinet.raised(self.shoulder_offset)
        half_width = cabinet.inner_width / 2
        # y, z [m] of the opening's corners
        self._opening = np.array([[-half_width, cabinet.floor], [half_width, cabinet.ceiling]])

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cabinet.raised(self.shoulder_offset).add(spec, "cabinet", "wood", inside="dark_wood", sides="glass")
        Wall().raised(self.shoulder_offset).add(spec, "wall", "plaster")
        super()._build(spec)

    def _beyond_front(self) -> float:
        """Distance [m] by which the cup must still move out; not positive once foot and bowl are both out."""
        cup = self.data.body(CUP)
        foot, rim = cup.xpos[0], cup.xpos[0] + self.cup.height * cup.xmat[2]
        farthest = np.max([foot + self.cup.foot_radius, rim + self.cup.bowl_radius])
        return float(farthest - (self.cabinet.front - OUTSIDE))

    def _outside(self) -> bool:
        return self._beyond_front() < 0

    def _distance_to_grasp(self, hand: Vector) -> float:
        lower, upper = self._opening
        if hand[0] > self.cabinet.front and np.all((lower < hand[1:]) & (hand[1:] < upper)):  # inside
            return super()._distance_to_grasp(hand)
        entry = np.append(self.cabinet.front, np.clip(hand[1:], lower + MARGIN, upper - MARGIN))
        return float(np.linalg.norm(hand - entry)) + super()._distance_to_grasp(entry)
