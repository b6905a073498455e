"""Lift Cup: the same cup at the same place on an open stand, where any elbow will do (control)."""

import mujoco

from sim_tasks.cup_task import CupTask
from sim_tasks.props import Stand


class LiftCup(CupTask):
    """Take the cup from an open stand; nothing is in the elbow's way."""

    task = "lift_cup"
    task_description = "Grasp the cup on the stand by its stem and lift it."
    max_steps = 260
    stand = Stand()
    obstacles = ("stand",)
    surface = stand.height
    centre = (0.72, 0.0)
    via = (-0.34, 0.0, 0.04)
    start = (1.132, -0.988, -0.315, -1.867, -1.083, 1.922, -1.732)
    elbow = 0.1

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.stand.add(spec, "stand", "wood")
        self.cup.add(spec, "cup", (*self.centre, self.surface), "copper")
