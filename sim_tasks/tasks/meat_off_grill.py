"""Meat Off Grill: put the asked piece of meat on the shelf at the grill's side (paper V-A)."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import UPRIGHT, WIDTH
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.release_task import ReleaseTask
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.grill import Grill, add_order
from sim_tasks.world.meat import CHICKEN, GRASP_HEIGHT, STEAK
from sim_tasks.world.randomisation import sides, span

GRILL, MEATS, ORDER = "grill", ("steak", "chicken"), "order"
BLUE, YELLOW = (0.10, 0.35, 0.95, 1.0), (0.95, 0.80, 0.10, 1.0)  # the upper face: steak, chicken
FLIPPED = (0.0, 1.0, 0.0, 0.0)  # quaternion of the order that asks for chicken
MIDDLE = (-0.02, 0.0)  # x, y [m] in the grill's frame between the pieces' mean places
APART = 0.18  # [m] between these
ZONE = (0.06, 0.06, 0.025)  # [m] half sides of where on the shelf a piece's underside must be
CLEAR = 0.002  # [m] by which the order lies above the grate's bars


class MeatOffGrill(ReleaseTask):
    """Take the asked piece and release it on the shelf.

    A disc lies where the asked piece lay at the start: blue side up for the steak, yellow for the chicken.
    """

    task = "meat_off_grill"
    task_description = "Put the marked piece of meat on the shelf beside the grill."
    objects = (GRILL, *MEATS, ORDER)
    graspable = MEATS
    arms = ("panda", "panda8")
    grill = Grill()
    centre = (0.54, 0.06)  # x, y [m] of the grill's mean place
    reward = Reward(reach=0.0625, place=0.25, release=0.25, success=0.4375)

    def __init__(
        self,
        *,
        grill_range: tuple[float, float] = (0.06, 0.06),
        grill_yaw_range: float = 0.5,
        meat_range: tuple[float, float] = (0.10, 0.06),
        meat_yaw_range: float = 0.4,
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            grill_range: Sides [m] of the rectangle in which the grill stands.
            grill_yaw_range: The grill is turned up to this far [rad].
            meat_range: Sides [m] of the rectangle on the grate in which each piece lies, one on either side.
            meat_yaw_range: Each piece is turned up to this far [rad] on the grate.
            kwargs: See :class:`sim_tasks.tasks.object_task.ObjectTask`.
        """
        self._grill_range = sides("grill_range", grill_range)
        self._grill_yaw_range = span("grill_yaw_range", grill_yaw_range)
        self._meat_range = sides("meat_range", meat_range)
        self._meat_yaw_range = span("meat_yaw_range", meat_yaw_range)
        self.asked = MEATS[0]  # of this episode
        super().__init__(**kwargs)
        self._zone = np.array([*self.grill.shelf_centre, self.grill.shelf + ZONE[2] - 0.005])  # in the grill's frame

    @property
    def needed(self) -> tuple[str, ...]:
        return (self.asked,)

    @property
    def grasp_point(self) -> Vector:
        """Where the asked piece is taken (3,) [m]."""
        return self.point(self.asked, (0.0, 0.0, GRASP_HEIGHT))

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {
            "meat": self.grasp_point - self.tip,
            "shelf": self.point(GRILL, self._zone.tolist()) - self.position(self.asked),
        }

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {GRILL: self.rotation(GRILL)[:, 0]}

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.grill.add(spec, GRILL)
        add_order(spec, ORDER, BLUE, YELLOW)
        for name, thing in zip(MEATS, (STEAK, CHICKEN), strict=True):
            thing.add(spec, name, (0.0, 0.0, self.grill.grate))

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._grill_range
        turn = rng.uniform(-self._grill_yaw_range, self._grill_yaw_range)
        placement: Placement = {GRILL: (x, y, turn)}
        side = rng.choice((-0.5, 0.5))  # of the steak
        for name, share in zip(MEATS, (side, -side), strict=True):
            along, across = np.array(MIDDLE) + (0.0, share * APART) + (rng.random(2) - 0.5) * self._meat_range
            placement[name] = (
                float(x + along * np.cos(turn) - across * np.sin(turn)),
                float(y + along * np.sin(turn) + across * np.cos(turn)),
                turn + rng.uniform(-self._meat_yaw_range, self._meat_yaw_range),
            )
        self.asked = str(rng.choice(MEATS))
        return placement | {ORDER: (*placement[self.asked][:2], 0.0)}

    def _arrange(self, placement: Placement) -> None:
        heights = {GRILL: 0.0} | dict.fromkeys(MEATS, self.grill.grate)
        for name, height in heights.items():
            x, y, yaw = placement[name]
            self._put(name, (x, y, height), yawed(yaw))
        x, y, _ = placement[ORDER]
        self._put(ORDER, (x, y, self.grill.grate + CLEAR), UPRIGHT if self.asked == MEATS[0] else FLIPPED)

    def _distance(self) -> float:
        """Distance [m] from the asked piece to the shelf; 0 if it is in place."""
        there = self.rotation(GRILL).T @ (self.position(self.asked) - self.position(GRILL))
        return float(np.linalg.norm(np.maximum(np.abs(there - self._zone) - ZONE, 0.0)))

    def _in_place(self) -> bool:
        return self._distance() == 0.0

    def _progress(self) -> dict[str, float]:
        distance = self._distance()
        if distance == 0.0:
            return {"reach": 1.0, "place": 1.0, "release": self.commanded_opening if self.grasped else 1.0}
        if self.held == self.asked:
            return {"reach": 1.0, "place": closeness(distance, WIDTH), "release": 0.0}
        reach = self._reach(self.grasp_point)
        return {"reach": reach, "place": 0.0, "release": 0.0}
