"""The furniture of the paper's cup tasks: a cup in a deep cabinet before the robot, a wall behind it (paper V-B).

Two things make the elbow matter. The robot has its back to a wall: while the hand is outside the
cabinet, an elbow that points up leans back into the wall, so it must be swung out to the side. The
compartment is narrow: deep inside, an elbow swung out drives the forearm into the side wall, so it
must point up. It has to change on the way, where the hand is in the opening; no fixed habit of the
elbow, and no wish to move it little, gets through both.
"""

import mujoco
import numpy as np

from sim_tasks.tasks.cup_task import CUP, CupTask
from sim_tasks.world.props import Cabinet, Wall

OUTSIDE = 0.02  # [m] between the cabinet's front and the whole of a cup that is out


class CabinetCup(CupTask):
    """A cup in the cabinet's depth."""

    cabinet = Cabinet()
    obstacles = ("cabinet", "wall")
    arms = ("panda", "panda8")
    surface = cabinet.floor
    centre = (0.72, 0.0)

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cabinet.raised(self.lift).add(spec, "cabinet", "wood", inside="dark_wood", sides="glass")
        Wall().raised(self.lift).add(spec, "wall", "plaster")
        super()._build(spec)

    def _outside(self) -> bool:
        """Whether foot and bowl are both before the cabinet."""
        cup = self._data.body(CUP)
        foot, rim = cup.xpos[0], cup.xpos[0] + self.cup.height * cup.xmat[2]
        farthest = np.max([foot + self.cup.foot_radius, rim + self.cup.bowl_radius])
        return bool(farthest < self.cabinet.front - OUTSIDE)
