"""Take Umbrella Out of Stand: lift a folded umbrella out of its stand, along its axis (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH, ObjectTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.umbrella import HANDLE_HEIGHT, UMBRELLA, UmbrellaStand

UMBRELLA_NAME, STAND = "umbrella", "stand"
BENCH = -0.001  # [m] z of the bench's surface
NEAR = 0.03  # [m] below the mark from which the umbrella counts as there
MARK = 0.03  # [m] of its tip above the stand's rim: so it counts as out once the tip is at the rim


class TakeUmbrellaOutOfStand(ObjectTask):
    """Grasp the umbrella and lift it until its tip has left the stand."""

    task = "take_umbrella_out_of_stand"
    task_description = "Take the umbrella out of the stand."
    objects = (UMBRELLA_NAME, STAND)
    graspable = (UMBRELLA_NAME,)
    start = (0.0, -1.17, 0.0, -2.68, 0.0, 2.03, np.pi / 4)  # the hand looks forward and down, before the umbrella
    stand = UmbrellaStand()
    centre = (0.50, 0.0)  # x, y [m] of the middle of the stand's places
    reward = Reward(reach=0.125, lift=0.5, success=0.375)

    def __init__(
        self, *, stand_range: tuple[float, float] = (0.20, 0.40), yaw_range: float = 0.7854, **kwargs: Any
    ) -> None:
        """Build the task.

        Args:
            stand_range: Sides [m] of the rectangle in which the stand is.
            yaw_range: The umbrella is turned up to this far [rad]; at 0 its hook opens away from the robot.
            kwargs: See :class:`ObjectTask`.
        """
        self._stand_range = sides("stand_range", stand_range)
        self._yaw_range = span("yaw_range", yaw_range)
        super().__init__(**kwargs)

    @property
    def handle(self) -> np.ndarray:
        """The middle of the handle in the base frame (3,) [m]."""
        return self.point(UMBRELLA_NAME, (0.0, 0.0, HANDLE_HEIGHT))

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {
            "handle": self.handle - self.tip,
            "mark": self.point(STAND, (0.0, 0.0, self.stand.height + MARK)) - self.position(UMBRELLA_NAME),
        }

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {UMBRELLA_NAME: self.rotation(UMBRELLA_NAME)[:, 2]}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.stand.add(spec, STAND, "steel", rim="cobalt")
        UMBRELLA.add(spec, UMBRELLA_NAME, (*self.centre, self.stand.floor))

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._stand_range
        yaw = rng.uniform(-self._yaw_range, self._yaw_range)
        return {UMBRELLA_NAME: (x, y, yaw), STAND: (x, y, 0.0)}

    def _arrange(self, placement: Placement) -> None:
        x, y, yaw = placement[UMBRELLA_NAME]
        self._put(UMBRELLA_NAME, (x, y, BENCH + self.stand.floor), yawed(yaw))
        x, y, yaw = placement[STAND]
        self._put(STAND, (x, y, BENCH), yawed(yaw))

    def _left(self) -> float:
        """How much [m] higher the umbrella's tip must be for the mark above the stand."""
        return float(self.position(STAND)[2] + self.stand.height + MARK - self.position(UMBRELLA_NAME)[2])

    def _succeeds(self) -> bool:
        return self.grasped and self._left() < NEAR

    def _progress(self) -> dict[str, float]:
        if not self.grasped:
            return {"reach": self._reach(self.handle), "lift": 0.0}
        return {"reach": 1.0, "lift": 1.0 if self._left() < NEAR else closeness(self._left(), WIDTH)}
