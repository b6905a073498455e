"""The base of the cup tasks: a goblet to grasp by its stem."""

from typing import Any

import mujoco
import numpy as np

from sim_tasks.tasks.pick_task import FREED, PickTask
from sim_tasks.tasks.placement import Placement
from sim_tasks.world.grip import firm_grip
from sim_tasks.world.props import Goblet
from sim_tasks.world.randomisation import sides

CUP = "cup"
TIPPED = np.cos(np.radians(25))  # cosine of the tilt from which a stemmed cup falls


class CupTask(PickTask):
    """Reach the cup, grasp its thin stem and lift it free."""

    objects = (CUP,)
    target = CUP
    grasp_height = 0.09  # mid-stem
    closed = 0.5
    cup = Goblet()
    surface: float  # z [m] on which the cup stands before a Panda
    centre: tuple[float, float]  # x, y [m] of the cup's mean place

    def __init__(self, *, cup_range: tuple[float, float] = (0.03, 0.03), **kwargs: Any) -> None:
        """Build the task.

        Args:
            cup_range: Sides [m] of the rectangle in which the cup stands.
            kwargs: See :class:`sim_tasks.tasks.arm_task.ArmTask`.
        """
        self._cup_range = sides("cup_range", cup_range)
        super().__init__(**kwargs)

    @property
    def support(self) -> float:
        return self.surface + self.shoulder_offset

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cup.add(spec, CUP, (*self.centre, self.support), "cobalt")
        firm_grip(spec)

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._cup_range
        return {CUP: (x, y, 0.0)}

    def _upright(self) -> bool:
        return bool(self.data.body(CUP).xmat[8] > TIPPED)  # the cup's own z axis against the world's

    def _succeeds(self) -> bool:
        return super()._succeeds() and self._upright()

    def _object_failure(self) -> str:
        if not self._upright() or self._height() < -FREED:
            return "dropped" if self._was_freed else "knocked_over"
        return ""
