"""Stack Wine: lay a standing bottle into the free place of a wine rack (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import TURN_WIDTH, WIDTH, ObjectTask
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.rewards import Reward, closeness, way_down
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.tableware import bottle
from sim_tasks.world.wine_rack import SEAT, WineRack

BOTTLE, RACK = "bottle", "rack"
BENCH = -0.001  # [m] z of the bench's surface
NEAR = 0.02  # [m] from its seat at which the bottle is in the rack: within the boards' scallops
ALIGNED = 0.2  # [rad] of its axis to the place's
NECK = 0.1  # [m] from the seat along the bottle's axis


class StackWine(ObjectTask):
    """Grasp the bottle, turn it to the horizontal and lay it into the rack, held or not."""

    task = "stack_wine"
    task_description = "Lay the wine bottle into the free place of the rack."
    objects = (BOTTLE, RACK)
    graspable = (BOTTLE,)
    arms = ("panda", "panda8")
    rack = WineRack()
    centres: Mapping[str, tuple[float, float]] = {
        BOTTLE: (0.47, 0.22),
        RACK: (0.46, -0.22),
    }  # x, y [m] of the middle of their places
    rack_yaw = 2 * np.pi / 3  # the bottle's neck to the left and back
    reward = Reward(reach=0.125, stack=0.5, success=0.375)

    def __init__(
        self,
        *,
        bottle_range: tuple[float, float] = (0.20, 0.20),
        rack_range: tuple[float, float] = (0.10, 0.10),
        rack_yaw_range: float = 0.4,
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            bottle_range: Sides [m] of the rectangle in which the bottle stands.
            rack_range: Sides [m] of that in which the rack stands.
            rack_yaw_range: The rack is turned up to this far [rad] either way.
            kwargs: See :class:`ObjectTask`.
        """
        self._ranges = {BOTTLE: sides("bottle_range", bottle_range), RACK: sides("rack_range", rack_range)}
        self._yaw_ranges = {BOTTLE: 0.0, RACK: span("rack_yaw_range", rack_yaw_range)}
        super().__init__(**kwargs)

    @property
    def grasp_point(self) -> Vector:
        """The point of the bottle's axis that is to be over the rack's middle, in the base frame (3,) [m]."""
        return self.point(BOTTLE, (0.0, 0.0, SEAT))

    @property
    def seat(self) -> Vector:
        """The place of that point in the rack, in the base frame (3,) [m]."""
        return self.point(RACK, (0.0, 0.0, self.rack.height))

    @property
    def ways(self) -> Mapping[str, Vector]:
        neck, notch = self.point(BOTTLE, (0.0, 0.0, SEAT + NECK)), self.point(RACK, (NECK, 0.0, self.rack.height))
        return {BOTTLE: self.grasp_point - self.tip, "seat": self.seat - self.grasp_point, "notch": notch - neck}

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {BOTTLE: self.rotation(BOTTLE)[:, 2], RACK: self.rotation(RACK)[:, 0]}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.rack.add(spec, RACK, "dark_wood", rail="wood")
        bottle().add(spec, BOTTLE, (*self.centres[BOTTLE], 0.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for name in self.objects:
            x, y = np.array(self.centres[name]) + (rng.random(2) - 0.5) * self._ranges[name]
            turn = rng.uniform(-self._yaw_ranges[name], self._yaw_ranges[name])
            placement[name] = (x, y, turn + (self.rack_yaw if name == RACK else 0.0))
        return placement

    def _arrange(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self._put(name, (x, y, BENCH), yawed(yaw))

    def _errors(self) -> tuple[float, float]:
        """How far the bottle is from lying in the rack: distance [m] and angle of its axis [rad]."""
        return float(np.linalg.norm(self.grasp_point - self.seat)), self._angle()

    def _angle(self) -> float:
        """Angle [rad] of the bottle's axis to that of the place."""
        cosine = float(self.rotation(BOTTLE)[:, 2] @ self.rotation(RACK)[:, 0])
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def _succeeds(self) -> bool:
        distance, angle = self._errors()
        return distance < NEAR and angle < ALIGNED

    def _progress(self) -> dict[str, float]:
        if self._succeeds():
            return {"reach": 1.0, "stack": 1.0}
        if not self.grasped:
            return {"reach": self._reach(self.grasp_point), "stack": 0.0}
        way = way_down(self.seat - self.grasp_point)
        return {"reach": 1.0, "stack": (closeness(way, WIDTH) + closeness(self._angle(), TURN_WIDTH)) / 2}
