"""Reach Cup: from above a deep cabinet, take the cup that stands inside by its stem (paper V-B).

The compartment is wide enough for a hand whose elbow stays above it, and too narrow for a forearm
that comes in sideways. The arm starts with its elbow swung out: it must change it on the way.
"""

import mujoco

from sim_tasks.cup_task import CupTask
from sim_tasks.props import Cabinet


class ReachCup(CupTask):
    """Take the cup out of the cabinet's depth; the elbow decides whether the forearm fits."""

    task = "reach_cup"
    task_description = "Reach into the cabinet, grasp the cup by its stem and lift it."
    max_steps = 260
    cabinet = Cabinet()
    obstacles = ("cabinet",)
    surface = cabinet.floor
    centre = (0.72, 0.0)
    via = (-0.34, 0.0, 0.04)
    start = (1.132, -0.988, -0.315, -1.867, -1.083, 1.922, -1.732)
    elbow = 0.1

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cabinet.add(spec, "cabinet", "wood", "dark_wood")
        self.cup.add(spec, "cup", (*self.centre, self.surface), "copper")
