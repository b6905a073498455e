"""Retrieve Bear: take the bear from a cluttered cabinet top and touch nothing else (paper V-B).

A vase and a cactus stand at the front with a gap between them. The forearm that reaches the bear through
it fits only with the elbow up; swung out, it sweeps one of them down. Before that, while the hand
is drawn back above the gap, an elbow that points up leans into the wall behind the robot: it must
be swung out. No constant posture of the elbow does both.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from sim_tasks.tasks.pick_task import FREED, PickTask
from sim_tasks.tasks.placement import Area, Placement
from sim_tasks.world.household import BEAR, BOOKS, CACTUS, HEAD_HEIGHT, LAMP, VASE, Sideboard, Thing
from sim_tasks.world.props import Wall
from sim_tasks.world.randomisation import sides, span

DISPLACED = 0.01  # [m] by which clutter may be pushed: a graze
TIPPED = np.cos(np.radians(15))  # cosine of the tilt of clutter beyond a graze


class RetrieveBear(PickTask):
    """Reach between tall things, grasp the bear by its head and lift it out."""

    task = "retrieve_bear"
    task_description = "Take the bear from the cluttered cabinet top without touching anything else."
    things: Mapping[str, Thing] = {"bear": BEAR, "vase": VASE, "cactus": CACTUS, "books": BOOKS, "lamp": LAMP}
    places: Mapping[str, tuple[float, float]] = {
        "bear": (0.66, 0.0),
        "vase": (0.31, 0.205),
        "cactus": (0.31, -0.18),
        "books": (0.83, -0.12),
        "lamp": (0.82, 0.18),
    }  # x, y [m] of the mean places
    objects = tuple(things)
    clutter = objects[1:]
    obstacles = ("sideboard", "wall")
    sideboard = Sideboard()
    area = Area((sideboard.front, sideboard.front + sideboard.depth), (-sideboard.width / 2, sideboard.width / 2))
    target = "bear"
    grasp_height = HEAD_HEIGHT
    lift_height = 0.10  # from which the bear is out of the clutter
    closed = 0.3
    start = (1.30, -0.995, -0.317, -1.805, -0.940, 1.450, 1.418)  # above the gap, the elbow out

    def __init__(
        self,
        *,
        bear_range: tuple[float, float] = (0.10, 0.065),
        clutter_range: tuple[float, float] = (0.03, 0.03),
        clutter_yaw_range: float = 0.2618,
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            bear_range: Sides [m] of the rectangle in which the bear sits.
            clutter_range: Sides [m] of the rectangle in which each other thing stands.
            clutter_yaw_range: Each other thing is turned up to this far [rad].
            kwargs: See :class:`sim_tasks.tasks.arm_task.ArmTask`.
        """
        self._bear_range = sides("bear_range", bear_range)
        self._clutter_range = sides("clutter_range", clutter_range)
        self._clutter_yaw_range = span("clutter_yaw_range", clutter_yaw_range)
        super().__init__(**kwargs)
        self._placed: dict[str, np.ndarray] = {}  # x, y [m] of each thing at the start

    @property
    def support(self) -> float:
        return self.sideboard.height

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.sideboard.add(spec, "sideboard", "wood", inner="dark_wood")
        Wall().add(spec, "wall", "plaster")
        for name, thing in self.things.items():
            thing.add(spec, name, (*self.places[name], self.support))

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for name, place in self.places.items():
            sides = self._clutter_range if name in self.clutter else self._bear_range
            x, y = np.array(place) + (rng.random(2) - 0.5) * sides
            turn = rng.uniform(-self._clutter_yaw_range, self._clutter_yaw_range) if name in self.clutter else 0.0
            placement[name] = (float(x), float(y), float(turn))
        return placement

    def _place(self, placement: Placement) -> None:
        super()._place(placement)
        self._placed = {name: np.array(place[:2]) for name, place in placement.items()}

    def _object_failure(self) -> str:
        for name in self.clutter:
            body = self.data.body(name)
            if body.xmat[8] < TIPPED:
                return "clutter_tipped"
            if np.linalg.norm(body.xpos[:2] - self._placed[name]) > DISPLACED:
                return "clutter_displaced"
        dropped = self._was_freed and not self._fingers_on_target()
        return "dropped" if dropped or self._height() < -FREED else ""
