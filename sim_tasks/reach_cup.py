"""Reach Cup: from above a deep cabinet, take the cup that stands inside by its stem (paper V-B).

Two things make the elbow matter. The robot has its back to a wall: while the hand is outside the
cabinet, an elbow that points up leans back into the wall, so it must be swung out to the side. The
compartment is narrow: deep inside, an elbow swung out drives the forearm into the side wall, so it
must point up. It has to change on the way, where the hand is in the opening; no fixed habit of the
elbow, and no wish to move it little, gets through both.
"""

import mujoco

from sim_tasks.cup_task import CUP, CupTask
from sim_tasks.props import Cabinet, Wall


class ReachCup(CupTask):
    """Take the cup in the cabinet's depth; the elbow decides whether the arm fits."""

    task = "reach_cup"
    task_description = "Reach into the cabinet, grasp the cup by its stem and lift it."
    max_steps = 240
    cabinet = Cabinet()
    obstacles = ("cabinet", "wall")
    surface = cabinet.floor
    centre = (0.72, 0.0)
    start = (1.25, -1.01, -0.32, -1.86, -1.18, 1.85, 1.44)  # above and in front of the cabinet
    way = (
        ((-0.34, 0.0, 0.04), 1.2),  # down before the opening, the elbow out, clear of the wall
        ((-0.24, 0.0, 0.02), 1.15),
        ((-0.10, 0.0, 0.01), 0.1),  # the elbow comes up while the forearm is still outside
        ((0.0, 0.0, 0.0), 0.1),
    )

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cabinet.add(spec, "cabinet", "wood", inside="dark_wood", sides="glass")
        Wall().add(spec, "wall", "plaster")
        self.cup.add(spec, CUP, (*self.centre, self.surface), "copper")
