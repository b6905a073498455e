"""Pick and Lift: grasp the red block among others and bring it to a mark (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.among_others import draw_among_others
from sim_tasks.tasks.carry_task import MARK, CarryTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward
from sim_tasks.world.blocks import BLOCK, block
from sim_tasks.world.household import Rgba
from sim_tasks.world.randomisation import interval, sides, span

RED, BLUE, YELLOW = "red_block", "blue_block", "yellow_block"
COLOURS: dict[str, Rgba] = {
    RED: (0.80, 0.10, 0.08, 1.0),
    BLUE: (0.12, 0.33, 0.75, 1.0),
    YELLOW: (0.93, 0.74, 0.14, 1.0),
}
LEAST = 0.12  # [m] between blocks, with room for the fingers


class PickAndLift(CarryTask):
    """The red block held at the mark."""

    task = "pick_and_lift"
    task_description = "Pick up the red block and lift it to the mark."
    objects = (*COLOURS, MARK)
    graspable = tuple(COLOURS)
    target = RED
    grasp_offset = (0.0, 0.0, BLOCK / 2)
    centre = (0.475, 0.0)  # x, y [m] of the middle of the red block's places, and of the mark's
    reward = Reward(reach=0.0625, lift=0.5, success=0.4375)

    def __init__(
        self,
        *,
        block_range: tuple[float, float] = (0.20, 0.40),
        block_yaw_range: float = 0.785,
        others_range: tuple[float, float] = (0.12, 0.20),
        mark_range: tuple[float, float] = (0.20, 0.40),
        mark_height_range: tuple[float, float] = (0.15, 0.35),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            block_range: Sides [m] of the rectangle in which the red block lies.
            block_yaw_range: Each block is turned up to this far [rad] to either side; a quarter of pi is any way.
            others_range: Smallest and largest distance [m] of the other blocks from the red one.
            mark_range: Sides [m] of the rectangle above which the mark is.
            mark_height_range: Lowest and highest mark [m] above the bench.
            kwargs: See :class:`ObjectTask`.
        """
        self._block_range = sides("block_range", block_range)
        self._block_yaw_range = span("block_yaw_range", block_yaw_range)
        self._others_range = interval("others_range", others_range, least=LEAST)
        self._mark_range = sides("mark_range", mark_range)
        self._mark_height_range = interval("mark_height_range", mark_height_range, least=BLOCK)
        self._mark_height = 0.0  # [m] in this episode
        super().__init__(**kwargs)

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {RED: self.rotation(RED)[:, 0]}

    def _approach(self) -> float:
        return self._reach_down(self.grasp_point)

    def _build(self, spec: mujoco.MjSpec) -> None:
        super()._build(spec)
        for name, colour in COLOURS.items():
            block(colour).add(spec, name, (0.0, 0.0, 0.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._mark_range
        self._mark_height = rng.uniform(*self._mark_height_range)
        return {MARK: (x, y, 0.0)} | draw_among_others(
            rng, RED, (BLUE, YELLOW), self.centre, self._block_range, self._others_range, self._block_yaw_range
        )

    def _arrange(self, placement: Placement) -> None:
        for name in COLOURS:
            x, y, yaw = placement[name]
            self._put(name, (x, y, 0.0), yawed(yaw))
        x, y, _ = placement[MARK]
        self._put(MARK, (x, y, self._mark_height))
