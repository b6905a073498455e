"""Slide Cup Obstacles: push a cup along the shelf behind a row of bottles (paper V-A).

The forearm lies in the gap of the row, between bottles as tall as itself, and turns there while the hand moves along
the shelf: the elbow has to swing to the other side than the hand, or the forearm presses on the bottles.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH, ObjectTask
from sim_tasks.tasks.placement import Area, Placement
from sim_tasks.tasks.rewards import Reward, closeness, share
from sim_tasks.world.crockery import teacup
from sim_tasks.world.fixed import add_fixed
from sim_tasks.world.props import CYLINDER
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.shelf import BarShelf
from sim_tasks.world.tableware import bottle

CUP, MARK = "cup", "mark"
COUNTER, SHELF = "counter", "shelf"
ROW = 0.29  # x [m] of the bottles
PLACES = (-0.19, -0.08, 0.18, 0.29, 0.40)  # y [m] of the bottles, by 11 cm but for the gap
BESIDE = 0.058  # [m] beside the cup's middle, where the tip of a closed hand touches the cup's side
TOUCH = 0.025  # [m] from there, within which the tip counts as there
HEIGHT = 0.055  # [m] above the shelf at which the hand pushes, its palm above the cup
FAR = 0.25  # [m] beyond any way to the mark
PLACED = 0.03  # [m] between the cup and the mark, at most
STANDS = np.cos(np.radians(15))  # of the tilt of a cup that stands
FALL = 0.075  # [m] by which the cup falls at a failure


class SlideCupObstacles(ObjectTask):
    """The cup on the mark, pushed from its right, the elbow swinging from left to right."""

    task = "slide_cup_obstacles"
    task_description = "Slide the cup along the shelf to the red mark."
    furniture = BarShelf()
    objects = (CUP, MARK)
    bottles = tuple(f"bottle{i}" for i in range(len(PLACES)))
    area = Area((furniture.back, furniture.back + furniture.board), (-furniture.width / 2, furniture.width / 2))
    start = (-1.3, -0.54, 0.77, -2.01, 0.83, 2.15, 0.02)  # the hand behind the row, the elbow to the left
    centre = (0.61, -0.06)  # x, y [m] of the middle of the cup's places
    distance = 0.17  # [m] between cup and mark on average
    reward = Reward(reach=0.0625, slide=0.5625, success=0.375)

    def __init__(
        self, *, cup_range: tuple[float, float] = (0.04, 0.04), distance_range: float = 0.02, **kwargs: Any
    ) -> None:
        """Build the task.

        Args:
            cup_range: Sides [m] of the rectangle in which the cup stands.
            distance_range: The way to the mark is up to this much [m] longer or shorter.
            kwargs: See :class:`ObjectTask`.
        """
        self._cup_range = sides("cup_range", cup_range)
        self._distance_range = span("distance_range", distance_range)
        super().__init__(**kwargs)
        self._top = self.furniture.height + self.shoulder_offset  # z [m] of the shelf

    def _build(self, spec: mujoco.MjSpec) -> None:
        furniture = self.furniture
        furniture.add(spec, COUNTER, SHELF, "wood", "dark_wood")
        for name, y in zip(self.bottles, PLACES, strict=True):
            add_fixed(spec, bottle(), name, (ROW, y, furniture.height))
        mark = spec.worldbody.add_body(name=MARK, mocap=True)
        mark.add_geom(type=CYLINDER, size=(0.045, 0.001, 0), material="red", contype=0, conaffinity=0, group=2)
        teacup().add(spec, CUP, (*self.centre, furniture.height))

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._cup_range
        way = self.distance + rng.uniform(-self._distance_range, self._distance_range)
        return {CUP: (x, y, 0.0), MARK: (x, y + way, 0.0)}

    def _arrange(self, placement: Placement) -> None:
        for name, (x, y, _) in placement.items():
            self._put(name, (x, y, self.furniture.height + 0.0005))

    @property
    def touched(self) -> tuple[str, ...]:
        return (CUP,)

    @property
    def push_point(self) -> Vector:
        """Where the tip of the hand pushes (3,) [m]: at the cup's right side, the mark being to its left."""
        x, y = self.position(CUP)[:2]
        return np.array([x, y - BESIDE, self._top + HEIGHT])

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {"beside": self.push_point - self.tip, MARK: np.append(self._way(), 0.0)}

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {CUP: self.rotation(CUP)[:, 2]}

    def _way(self) -> Vector:
        """From the cup to the mark (2,) [m]."""
        return (self.position(MARK) - self.position(CUP))[:2]

    def _succeeds(self) -> bool:
        stands = self.rotation(CUP)[2, 2] > STANDS and abs(self.position(CUP)[2] - self._top) < 0.01
        return bool(stands and np.linalg.norm(self._way()) < PLACED)

    def _fails(self) -> str:
        return "cup_fell" if self.position(CUP)[2] < self._top - FALL else ""

    def _progress(self) -> dict[str, float]:
        if self._succeeds():
            return {"reach": 1.0, "slide": 1.0}
        gap = float(np.linalg.norm(self.tip - self.push_point))
        reach = closeness(max(gap - TOUCH, 0.0), WIDTH)
        return {"reach": reach, "slide": reach * share(float(np.linalg.norm(self._way())), FAR)}
