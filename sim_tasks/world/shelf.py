"""A counter and, behind it, a shelf of the same height, as in a bar."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.props import BOX


@dataclass(frozen=True)
class BarShelf:
    """A narrow counter before an open shelf on two side panels; both face the robot (-x)."""

    front: float = 0.24  # x of the counter's front
    depth: float = 0.11  # of the counter
    back: float = 0.51  # x of the shelf's front edge
    board: float = 0.20  # depth of the shelf
    width: float = 0.90  # of both
    height: float = 0.42  # z of both tops

    def add(self, spec: mujoco.MjSpec, counter: str, shelf: str, material: str, inner: str) -> None:
        """Add two bodies fixed to the world, ``counter`` and ``shelf``; the counter's face is ``inner``."""
        t, half = 0.010, self.height / 2  # [m] half thickness of the boards
        case = spec.worldbody.add_body(name=counter, pos=(self.front + self.depth / 2, 0.0, 0.0))
        block = (self.depth / 2, self.width / 2, half)
        case.add_geom(name=f"{counter}_case", type=BOX, size=block, pos=(0.0, 0.0, half), material=material)
        seen = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        for side in (-1, 1):
            case.add_geom(
                name=f"{counter}_panel_{side}",
                type=BOX,
                size=(0.004, self.width / 4 - 0.02, half - 0.03),
                pos=(-self.depth / 2, side * self.width / 4, half),
                material=inner,
                **seen,
            )
        body = spec.worldbody.add_body(name=shelf, pos=(self.back + self.board / 2, 0.0, 0.0))
        # Smooth (by its priority, whatever stands on it), so that a pushed cup slides and does not tip, but it resists
        # turning, so that the cup does not roll along the hand.
        body.add_geom(
            name=f"{shelf}_board",
            type=BOX,
            size=(self.board / 2, self.width / 2, t),
            pos=(0.0, 0.0, self.height - t),
            material=material,
            friction=(0.3, 0.03, 0.0001),
            priority=1,
        )
        for side in (-1, 1):
            body.add_geom(
                name=f"{shelf}_side_{side}",
                type=BOX,
                size=(self.board / 2, t, half - t),
                pos=(0.0, side * (self.width / 2 - t), half - t),
                material=inner,
            )
