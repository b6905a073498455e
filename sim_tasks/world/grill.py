"""A charcoal grill with its lid up behind and a shelf at its side."""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from sim_tasks.world.household import Rgba
from sim_tasks.world.props import BOX, CAPSULE, CYLINDER, MESH

ENAMEL, IRON = (0.70, 0.10, 0.08, 1.0), (0.13, 0.13, 0.14, 1.0)
EMBER, CHROME = (0.42, 0.11, 0.03, 1.0), (0.50, 0.51, 0.53, 1.0)
SEEN = {"contype": 0, "conaffinity": 0, "group": 2}
HIDDEN = {"group": 3}


@dataclass(frozen=True)
class Grill:
    """A grill that can be put anywhere; its open front faces -x, its shelf -y. Lengths and heights [m]."""

    depth: float = 0.30
    width: float = 0.40
    grate: float = 0.16  # height of the grate
    shelf: float = 0.15  # height of the shelf's top
    shelf_side: float = 0.22
    legs: float = 0.06
    lean: float = 45.0  # [deg] of the lid, backwards

    @property
    def shelf_centre(self) -> tuple[float, float]:
        """The shelf's middle: x, y in the grill's frame."""
        return 0.0, -(self.width + self.shelf_side) / 2 - 0.005

    def add(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the grill as a mocap body whose origin is the middle of its firebox, on the ground."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        self._add_firebox(body)
        self._add_shelf(body)
        self._add_lid(spec, body, name)
        return body

    def _add_firebox(self, body: mujoco.MjsBody) -> None:
        x, y, rim = self.depth / 2, self.width / 2, 0.012
        middle, half = (self.legs + self.grate) / 2, (self.grate - self.legs) / 2
        body.add_geom(type=BOX, size=(x, y, half), pos=(0, 0, middle), **HIDDEN)
        body.add_geom(type=BOX, size=(x, y, half - 0.006), pos=(0, 0, middle - 0.006), rgba=IRON, **SEEN)
        embers = (x - rim, y - rim, 0.001)
        body.add_geom(type=BOX, size=embers, pos=(0, 0, self.grate - 0.011), rgba=EMBER, **SEEN)
        for side in (-1, 1):
            body.add_geom(
                type=BOX, size=(rim / 2, y, 0.006), pos=(side * (x - rim / 2), 0, self.grate - 0.006), rgba=IRON, **SEEN
            )
            body.add_geom(
                type=BOX, size=(x, rim / 2, 0.006), pos=(0, side * (y - rim / 2), self.grate - 0.006), rgba=IRON, **SEEN
            )
            for end in (-1, 1):
                foot = (0.009, self.legs / 2, 0)
                place = (end * (x - 0.03), side * (y - 0.03), self.legs / 2)
                body.add_geom(type=CYLINDER, size=foot, pos=place, rgba=IRON, **SEEN)
        for bar in np.linspace(rim - y, y - rim, 21)[1:-1]:
            body.add_geom(type=BOX, size=(x - rim, 0.003, 0.003), pos=(0, bar, self.grate - 0.003), rgba=CHROME, **SEEN)

    def _add_shelf(self, body: mujoco.MjsBody) -> None:
        (x, y), half, thickness = self.shelf_centre, self.shelf_side / 2, 0.008
        size = (half, half, thickness)
        body.add_geom(type=BOX, size=size, pos=(x, y, self.shelf - thickness), material="wood")
        for end in (-1, 1):
            leg = (0.007, self.shelf / 2 - thickness, 0)
            place = (end * (half - 0.02), y - half + 0.02, leg[1])
            body.add_geom(type=CYLINDER, size=leg, pos=place, rgba=IRON, **SEEN)

    def _add_lid(self, spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str) -> None:
        """A half tube with closed ends, its mouth to the front, hinged at the firebox's rear edge."""
        radius, half_width, facets, wall = self.depth / 2, self.width / 2, 5, 0.004
        hinge = (self.depth / 2 + 0.01, 0, self.grate)
        lid = body.add_body(name=f"{name}_lid", pos=hinge, quat=_turned("y", np.radians(self.lean)))
        span = np.pi / facets
        for angle in (np.arange(facets) + 0.5) * span:  # from the hinge up
            out, up = np.sin(angle), -np.cos(angle)
            lid.add_geom(
                type=BOX,
                size=(wall, half_width, radius * np.tan(span / 2)),
                pos=(radius * out, 0, radius * (1 + up)),
                quat=_turned("y", -np.arctan2(up, out)),
                rgba=ENAMEL,
            )
        arc = np.linspace(0, np.pi, 13)
        outline = np.column_stack([radius * np.sin(arc), np.zeros_like(arc), radius * (1 - np.cos(arc))])
        mesh = spec.add_mesh(name=f"{name}_lid_end")
        thickness = np.array([0, wall, 0])
        mesh.uservert = np.concatenate([outline - thickness, outline + thickness]).ravel()
        for side in (-1, 1):
            lid.add_geom(type=MESH, meshname=mesh.name, pos=(0, side * (half_width - wall), 0), rgba=ENAMEL)
        top = 2 * radius
        bar, level = (0.008, half_width / 2, 0), _turned("x", np.pi / 2)
        lid.add_geom(type=CAPSULE, size=bar, pos=(0.05, 0, top + 0.03), quat=level, rgba=CHROME, **SEEN)
        for side in (-1, 1):
            bracket, place = (0.004, 0.02, 0), (0.05, side * half_width / 2, top + 0.01)
            lid.add_geom(type=CYLINDER, size=bracket, pos=place, rgba=CHROME, **SEEN)


def add_order(spec: mujoco.MjSpec, name: str, upper: Rgba, lower: Rgba) -> None:
    """Add a disc that marks a place on the grate: a mocap body that touches nothing, of another colour turned over."""
    body = spec.worldbody.add_body(name=name, mocap=True)
    for rgba, z in ((upper, 0.0005), (lower, -0.0005)):
        body.add_geom(type=CYLINDER, size=(0.065, 0.0005, 0), pos=(0, 0, z), rgba=rgba, **SEEN)


def _turned(axis: str, angle: float) -> list[float]:
    """Quaternion (w, x, y, z) of a turn [rad] about an axis."""
    return Rotation.from_euler(axis, angle).as_quat(scalar_first=True).tolist()
