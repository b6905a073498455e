"""A press with two-hand control: a console, guards before it, and tables on both sides of who works there."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.props import BOX
from sim_tasks.world.scene import FLOOR

SIDES = {"left": 1.0, "right": -1.0}


@dataclass(frozen=True)
class Press:
    """The machine in the frame of who works at it: x towards it, y left [m]. Each part is a body fixed to the world."""

    face: float = 0.58  # x of the console's front
    depth: float = 0.25
    width: float = 0.80
    top: float = 0.12  # z of the console's top
    guards: tuple[float, float] = (0.24, 0.32)  # x of the two guards, upright plates
    gap: float = 0.43  # between them
    guard_top: float = 0.16
    tables: tuple[float, float] = (-0.30, 0.03)  # x of the two tables
    aisle: float = 0.20  # between them
    table_width: float = 0.34
    table_top: float = -0.18

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return ("console", *(f"{side}_{part}" for part in ("guard", "table") for side in SIDES))

    def add(self, spec: mujoco.MjSpec) -> None:
        """Add the machine and the tables."""
        _box(spec, "console", (self.face, self.face + self.depth), (0.0, self.width), self.top, "steel")
        console = spec.body("console")
        seen = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        # The tool above the work, to look at.
        ram = (0.02, 0.0, self.top + 0.22)
        console.add_geom(name="ram", type=BOX, size=(0.08, 0.30, 0.08), pos=ram, material="bench", **seen)
        for side, sign in SIDES.items():
            post = (0.06, sign * 0.26, self.top + 0.15)
            console.add_geom(name=f"{side}_post", type=BOX, size=(0.04, 0.04, 0.15), pos=post, material="bench", **seen)
            _box(spec, f"{side}_guard", self.guards, (sign * (self.gap / 2 + 0.01), 0.02), self.guard_top, "yellow")
            middle = sign * (self.aisle + self.table_width) / 2
            _box(spec, f"{side}_table", self.tables, (middle, self.table_width), self.table_top, "wood", board=0.03)


def _box(
    spec: mujoco.MjSpec,
    name: str,
    x: tuple[float, float],
    y: tuple[float, float],
    top: float,
    material: str,
    board: float | None = None,
) -> None:
    """A body between two x, at the middle and of the width ``y``, from the floor or ``board`` thick, up to ``top``."""
    (front, back), (middle, width), bottom = x, y, FLOOR if board is None else top - board
    body = spec.worldbody.add_body(name=name, pos=((front + back) / 2, middle, 0.0))
    size, centre = ((back - front) / 2, width / 2, (top - bottom) / 2), (0.0, 0.0, (top + bottom) / 2)
    body.add_geom(name=name, type=BOX, size=size, pos=centre, material=material)
    if board is not None:
        legs = (0.03, width / 2 - 0.02, (bottom - FLOOR) / 2)
        pose = (0.0, 0.0, (bottom + FLOOR) / 2)
        body.add_geom(name=f"{name}_legs", type=BOX, size=legs, pos=pose, material="steel", contype=0, conaffinity=0)
