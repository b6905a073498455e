"""Lift Cup: the same cup on an open stand, where any elbow will do (the negative control)."""

import mujoco

from sim_tasks.tasks.cup_task import CupTask
from sim_tasks.world.props import Stand


class LiftCup(CupTask):
    """Take the cup from an open stand; nothing is in the elbow's way."""

    task = "lift_cup"
    task_description = "Grasp the cup on the stand by its stem and lift it."
    max_steps = 200
    stand = Stand()
    obstacles = ("stand",)
    arms = ("panda", "panda8")
    surface = stand.height
    centre = stand.centre
    start = (0.0, -0.83, 0.0, -1.95, 0.0, 2.34, 0.785)  # above and in front of the stand, the elbow up
    way = (
        ((-0.20, 0.0, 0.04), None),
        ((-0.10, 0.0, 0.01), None),
        ((0.003, 0.0, 0.0), None),  # the stem in the middle of the finger pads
    )
    way_back = (((-0.03, 0.0, 0.025), None),)  # lifted
    lean = 0.2

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.stand.raised(self.lift).add(spec, "stand", "wood")
        super()._build(spec)
