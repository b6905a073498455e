"""A cordless phone: a free handset, and the base station with the cradle that it rests in."""

from dataclasses import dataclass
from typing import ClassVar

import mujoco
import numpy as np

from sim_tasks.world.household import BLACK, CREAM, Primitive, Rgba, Thing
from sim_tasks.world.props import BOX, CYLINDER, MESH

CHARCOAL, SCREEN, KEY, GREEN_KEY, RED_KEY = (
    (0.16, 0.17, 0.19, 1.0),
    (0.55, 0.78, 0.86, 1.0),
    (0.82, 0.84, 0.86, 1.0),
    (0.20, 0.62, 0.30, 1.0),
    (0.80, 0.20, 0.18, 1.0),
)
WHITE: Rgba = (0.92, 0.93, 0.94, 1.0)

LENGTH, WIDTH, THICKNESS = 0.150, 0.046, 0.030  # [m] of the handset
FACE = THICKNESS - 0.002  # [m] height of the face's middle

# x points from the earpiece to the microphone, z out of the face.
HANDSET = Thing(
    mass=0.12,
    looks=(
        Primitive(BOX, (LENGTH / 2, WIDTH / 2, THICKNESS / 2 - 0.001), (0.0, 0.0, THICKNESS / 2 - 0.001), CHARCOAL),
        Primitive(BOX, (0.017, 0.017, 0.003), (-0.033, 0.0, FACE), SCREEN),
        Primitive(BOX, (0.002, 0.010, 0.003), (-0.063, 0.0, FACE), BLACK),  # earpiece
        Primitive(BOX, (0.004, 0.006, 0.003), (-0.006, 0.014, FACE), GREEN_KEY),
        Primitive(BOX, (0.004, 0.006, 0.003), (-0.006, -0.014, FACE), RED_KEY),
        *(
            Primitive(BOX, (0.004, 0.005, 0.003), (0.009 + 0.014 * row, 0.014 * column, FACE), KEY)
            for row in range(4)
            for column in (-1, 0, 1)
        ),
        Primitive(CYLINDER, (0.006, 0.014, 0.0), (-0.087, 0.015, THICKNESS / 2), CHARCOAL, (0.0, 90.0, 0.0)),  # aerial
    ),
    touch=((Primitive(BOX, (LENGTH / 2, WIDTH / 2, THICKNESS / 2), (0.0, 0.0, THICKNESS / 2)), 1.0),),
)


@dataclass(frozen=True)
class BaseStation:
    """A wedge whose sloping top is the cradle; its frame's origin is on the ground under the cradle, x downhill."""

    slope: float = 0.44  # [rad]
    seat: float = 0.050  # [m] height of the middle of the resting handset's underside
    half_length: ClassVar[float] = 0.085  # [m] along the slope
    half_width: ClassVar[float] = 0.040

    @property
    def rest(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the handset rests: position (3,) [m] and orientation (3, 3) in the station's frame."""
        cos, sin = np.cos(self.slope), np.sin(self.slope)
        return np.array([0.0, 0.0, self.seat]), np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])

    def add(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the station as a mocap body, which can be put anywhere."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        position, rotation = self.rest
        self._add_wedge(spec, body, position, rotation)
        cradle = body.add_body(name=f"{name}_cradle", pos=position)
        cradle.quat = (np.cos(self.slope / 2), 0.0, np.sin(self.slope / 2), 0.0)
        lip, gap, low = 0.0035, 0.004, 0.0035  # [m] half thickness, gap beside the handset, half height
        side, end = WIDTH / 2 + gap + lip, LENGTH / 2 + gap + lip
        for y in (side, -side):
            cradle.add_geom(type=BOX, size=(0.055, lip, low), pos=(0.024, y, low), rgba=WHITE)
        cradle.add_geom(type=BOX, size=(lip, self.half_width, 2 * low), pos=(end, 0, 2 * low), rgba=WHITE)
        seen = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        cradle.add_geom(type=BOX, size=(0.076, WIDTH / 2 + gap, 0.0005), pos=(0.0, 0, 0), rgba=BLACK, **seen)
        cradle.add_geom(
            type=CYLINDER, size=(0.004, 0.002, 0), pos=(-0.070, 0.033, 0.0), rgba=(0.2, 0.9, 0.3, 1), **seen
        )
        for y in (0.007, -0.007):  # contacts of the charger
            cradle.add_geom(type=BOX, size=(0.006, 0.003, 0.001), pos=(0.055, y, 0.0), rgba=(0.8, 0.7, 0.3, 1), **seen)
        return body

    def _add_wedge(self, spec: mujoco.MjSpec, body: mujoco.MjsBody, position: np.ndarray, rotation: np.ndarray) -> None:
        sides = (self.half_width, -self.half_width)
        top = [
            position + rotation @ np.array([x, y, 0.0]) for x in (-self.half_length, self.half_length) for y in sides
        ]
        (back, _, front, _), foot = top, 0.015  # [m] by which it stands out behind
        bottom = [np.array([x, y, 0.0]) for x in (back[0] - foot, front[0]) for y in sides]
        wedge = spec.add_mesh(name=body.name)
        wedge.uservert = np.concatenate([*top, *bottom])
        body.add_geom(type=MESH, meshname=body.name, rgba=CREAM)
