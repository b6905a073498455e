"""Pick Up Cup: take the red one of two cups away from its place (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.among_others import draw_among_others
from sim_tasks.tasks.carry_task import GraspTask
from sim_tasks.tasks.object_task import WIDTH
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.world.household import Rgba
from sim_tasks.world.randomisation import interval, sides
from sim_tasks.world.tableware import CUP_HEIGHT, cup

RED, BLUE = "red_cup", "blue_cup"
COLOURS: dict[str, Rgba] = {RED: (0.80, 0.10, 0.08, 1.0), BLUE: (0.12, 0.33, 0.75, 1.0)}
LEAST = 0.13  # [m] between cups, with room for the fingers
LEFT = 0.10  # [m] from its place at which the cup has left it


class PickUpCup(GraspTask):
    """The red cup held, away from its place."""

    task = "pick_up_cup"
    task_description = "Pick up the red cup."
    objects = tuple(COLOURS)
    graspable = tuple(COLOURS)
    target = RED
    grasp_offset = (0.0, 0.0, CUP_HEIGHT - 0.025)
    centre = (0.475, 0.0)  # x, y [m] of the middle of the red cup's places

    def __init__(
        self,
        *,
        cup_range: tuple[float, float] = (0.20, 0.40),
        other_range: tuple[float, float] = (0.13, 0.22),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            cup_range: Sides [m] of the rectangle in which the red cup stands.
            other_range: Smallest and largest distance [m] of the other cup from the red one.
            kwargs: See :class:`ObjectTask`.
        """
        self._cup_range = sides("cup_range", cup_range)
        self._other_range = interval("other_range", other_range, least=LEAST)
        self._start: Vector = np.zeros(3)  # [m] the red cup's place in this episode
        super().__init__(**kwargs)

    def _build(self, spec: mujoco.MjSpec) -> None:
        for name, colour in COLOURS.items():
            cup(colour).add(spec, name, (0.0, 0.0, 0.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        return draw_among_others(rng, RED, (BLUE,), self.centre, self._cup_range, self._other_range, 0.0)

    def _arrange(self, placement: Placement) -> None:
        for name in COLOURS:
            x, y, yaw = placement[name]
            self._put(name, (x, y, 0.0), yawed(yaw))
        x, y, _ = placement[RED]
        self._start = np.array([x, y, self.shoulder_offset])

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {RED: self.grasp_point - self.tip, "moved": self.position(RED) - self._start}

    def _lift(self) -> float:
        moved = float(np.linalg.norm(self.position(RED) - self._start))
        return 1.0 if moved > LEFT else float(np.tanh(moved / WIDTH))
