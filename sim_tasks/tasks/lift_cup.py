"""Lift Cup: the same cup on an open stand, where any elbow posture works (the negative control)."""

import mujoco

from sim_tasks.tasks.cup_task import CupTask
from sim_tasks.tasks.placement import Area
from sim_tasks.world.props import Stand


class LiftCup(CupTask):
    """Take the cup from an open stand; nothing is in the elbow's way."""

    task = "lift_cup"
    task_description = "Grasp the cup on the stand by its stem and lift it."
    stand = Stand()
    obstacles = ("stand",)
    arms = ("panda", "panda8")
    surface = stand.height
    centre = stand.centre
    area = Area.around(stand.centre, stand.size)
    start = (0.0, -0.83, 0.0, -1.95, 0.0, 2.34, 0.785)  # above and in front of the stand, the elbow up

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.stand.raised(self.shoulder_offset).add(spec, "stand", "wood")
        super()._build(spec)
