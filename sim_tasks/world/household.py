"""Free household objects with detailed visual and simple collision shapes.

Visual shapes do not collide; hidden boxes and cylinders of about the same size do. Frames: the origin is the
middle of the underside, z up; an object with a face looks along -x, at the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from sim_tasks.world.props import BOX, CAPSULE, CYLINDER

ELLIPSOID = mujoco.mjtGeom.mjGEOM_ELLIPSOID

Rgba = tuple[float, float, float, float]
Triple = tuple[float, float, float]

FUR, PALE_FUR, BLACK = (0.62, 0.40, 0.21, 1.0), (0.87, 0.72, 0.52, 1.0), (0.08, 0.06, 0.06, 1.0)
RED, LEAF = (0.78, 0.16, 0.17, 1.0), (0.25, 0.50, 0.22, 1.0)
TERRACOTTA, SOIL = (0.72, 0.38, 0.24, 1.0), (0.25, 0.17, 0.12, 1.0)
CREAM, BRASS, BLUE = (0.96, 0.92, 0.82, 1.0), (0.72, 0.58, 0.30, 1.0), (0.22, 0.40, 0.62, 1.0)
YELLOW, PINK, OCHRE = (0.95, 0.78, 0.22, 1.0), (0.90, 0.55, 0.62, 1.0), (0.80, 0.55, 0.22, 1.0)


@dataclass(frozen=True)
class Primitive:
    """One primitive shape of a thing, in the thing's frame."""

    kind: int  # MuJoCo's geom type
    size: Triple  # [m] half extents, or radius and half height
    centre: Triple  # [m]
    rgba: Rgba = CREAM
    turn: Triple = (0.0, 0.0, 0.0)  # [deg] about x, y, z


@dataclass(frozen=True)
class Thing:
    """A free body made of visual and collision primitives."""

    mass: float  # [kg]
    looks: tuple[Primitive, ...]  # visual only
    touch: tuple[tuple[Primitive, float], ...]  # collision only, each with its share of the mass
    grip: Primitive | None = None  # the one of these that a hand is to take it by; any if None
    rolling: float | None = None  # [m] rolling friction of what is not smooth and round; as good as none if None

    def add(self, spec: mujoco.MjSpec, name: str, position: Sequence[float]) -> mujoco.MjsBody:
        """Add the thing with a free joint of its name."""
        body = spec.worldbody.add_body(name=name, pos=position)
        body.add_freejoint(name=name)
        for primitive in self.looks:
            _geom(body, primitive, mass=0, contype=0, conaffinity=0, group=2)
        for primitive, share in self.touch:
            name_of = {"name": grip_name(name)} if primitive is self.grip else {}
            rolls = {"friction": (1.0, 0.02, self.rolling or 0.0005), "condim": 6 if self.rolling else 4}
            solid = {"mass": share * self.mass, "group": 3} | rolls
            _geom(body, primitive, **solid, **name_of)
        return body


def grip_name(name: str) -> str:
    """Name of the collision shape that a thing is to be taken by."""
    return f"{name}_grip"


def _geom(body: mujoco.MjsBody, primitive: Primitive, **kwargs: object) -> None:
    x, y, z, w = Rotation.from_euler("XYZ", primitive.turn, degrees=True).as_quat()
    look = {"size": primitive.size, "pos": primitive.centre, "quat": (w, x, y, z), "rgba": primitive.rgba}
    body.add_geom(type=primitive.kind, **look, **kwargs)


def _pair(
    kind: int, size: Triple, centre: Triple, rgba: Rgba, turn: Triple = (0.0, 0.0, 0.0)
) -> tuple[Primitive, Primitive]:
    """Two shapes, left and right of the middle."""
    x, y, z = centre
    a, b, c = turn
    return Primitive(kind, size, (x, y, z), rgba, (a, b, c)), Primitive(kind, size, (x, -y, z), rgba, (-a, b, -c))


HEAD_HEIGHT = 0.128  # [m] of the middle of the bear's head, where fingers find it

BEAR = Thing(
    mass=0.15,
    looks=(
        Primitive(ELLIPSOID, (0.036, 0.038, 0.050), (0.0, 0.0, 0.050), FUR),  # torso
        Primitive(ELLIPSOID, (0.022, 0.027, 0.034), (-0.019, 0.0, 0.048), PALE_FUR),  # belly
        Primitive(ELLIPSOID, (0.031, 0.031, 0.031), (0.0, 0.0, HEAD_HEIGHT), FUR),
        Primitive(ELLIPSOID, (0.015, 0.017, 0.013), (-0.026, 0.0, HEAD_HEIGHT - 0.008), PALE_FUR),  # snout
        Primitive(ELLIPSOID, (0.005, 0.007, 0.005), (-0.040, 0.0, HEAD_HEIGHT - 0.003), BLACK),  # nose
        *_pair(ELLIPSOID, (0.004, 0.005, 0.005), (-0.027, 0.012, HEAD_HEIGHT + 0.010), BLACK),  # eyes
        *_pair(ELLIPSOID, (0.007, 0.013, 0.013), (0.004, 0.024, HEAD_HEIGHT + 0.027), FUR),  # ears
        *_pair(ELLIPSOID, (0.004, 0.008, 0.008), (-0.002, 0.024, HEAD_HEIGHT + 0.027), PALE_FUR),
        *_pair(ELLIPSOID, (0.015, 0.015, 0.034), (-0.018, 0.040, 0.066), FUR, (20.0, 40.0, 0.0)),  # arms
        *_pair(ELLIPSOID, (0.036, 0.018, 0.018), (-0.034, 0.028, 0.018), FUR, (0.0, 0.0, -15.0)),  # legs
        *_pair(ELLIPSOID, (0.006, 0.013, 0.013), (-0.066, 0.037, 0.020), PALE_FUR, (0.0, 0.0, -15.0)),  # soles
        Primitive(CYLINDER, (0.024, 0.004, 0.0), (0.0, 0.0, 0.098), RED),  # a ribbon round the neck
        *_pair(ELLIPSOID, (0.006, 0.011, 0.008), (-0.027, 0.011, 0.097), RED, (25.0, 0.0, 0.0)),
    ),
    touch=(
        # Upright, so that the fingers find it alike from every side.
        (Primitive(CYLINDER, (0.030, 0.028, 0.0), (0.0, 0.0, HEAD_HEIGHT)), 0.2),
        (Primitive(CYLINDER, (0.034, 0.045, 0.0), (0.0, 0.0, 0.055)), 0.4),
        (Primitive(BOX, (0.050, 0.044, 0.015), (-0.018, 0.0, 0.015)), 0.4),
    ),
)

CACTUS = Thing(
    mass=1.2,
    looks=(
        Primitive(CYLINDER, (0.042, 0.030, 0.0), (0.0, 0.0, 0.030), TERRACOTTA),
        Primitive(CYLINDER, (0.048, 0.010, 0.0), (0.0, 0.0, 0.065), TERRACOTTA),  # the pot's rim
        Primitive(CYLINDER, (0.041, 0.002, 0.0), (0.0, 0.0, 0.075), SOIL),
        Primitive(CAPSULE, (0.028, 0.100, 0.0), (0.0, 0.0, 0.190), LEAF),
        Primitive(CAPSULE, (0.013, 0.016, 0.0), (0.0, 0.038, 0.165), LEAF, (90.0, 0.0, 0.0)),
        Primitive(CAPSULE, (0.013, 0.030, 0.0), (0.0, 0.054, 0.195), LEAF),
        Primitive(CAPSULE, (0.013, 0.012, 0.0), (0.0, -0.036, 0.205), LEAF, (90.0, 0.0, 0.0)),
        Primitive(CAPSULE, (0.013, 0.025, 0.0), (0.0, -0.050, 0.230), LEAF),
        Primitive(ELLIPSOID, (0.016, 0.016, 0.010), (0.0, 0.0, 0.320), PINK),
    ),
    touch=(
        (Primitive(CYLINDER, (0.048, 0.038, 0.0), (0.0, 0.0, 0.038)), 0.8),
        (Primitive(CYLINDER, (0.030, 0.123, 0.0), (0.0, 0.0, 0.199)), 0.1),
        (Primitive(BOX, (0.013, 0.065, 0.050), (0.0, 0.0, 0.205)), 0.1),  # the arms
    ),
)

VASE = Thing(
    mass=0.9,
    looks=(
        Primitive(CYLINDER, (0.032, 0.010, 0.0), (0.0, 0.0, 0.010), BLUE),
        Primitive(ELLIPSOID, (0.048, 0.048, 0.080), (0.0, 0.0, 0.085), BLUE),
        Primitive(CYLINDER, (0.022, 0.030, 0.0), (0.0, 0.0, 0.165), BLUE),
        Primitive(CYLINDER, (0.030, 0.005, 0.0), (0.0, 0.0, 0.197), CREAM),
        *_pair(CYLINDER, (0.003, 0.045, 0.0), (0.0, 0.012, 0.235), LEAF, (-14.0, 0.0, 0.0)),
        Primitive(CYLINDER, (0.003, 0.050, 0.0), (0.0, 0.0, 0.245), LEAF),
        *_pair(ELLIPSOID, (0.022, 0.022, 0.018), (0.0, 0.026, 0.275), PINK),
        *_pair(ELLIPSOID, (0.009, 0.009, 0.022), (0.0, 0.026, 0.275), YELLOW),
        Primitive(ELLIPSOID, (0.022, 0.022, 0.018), (0.0, 0.0, 0.305), YELLOW),
        Primitive(ELLIPSOID, (0.009, 0.009, 0.022), (0.0, 0.0, 0.305), OCHRE),
    ),
    touch=(
        (Primitive(CYLINDER, (0.045, 0.075, 0.0), (0.0, 0.0, 0.075)), 0.8),
        (Primitive(CYLINDER, (0.030, 0.025, 0.0), (0.0, 0.0, 0.175)), 0.1),
        (Primitive(CYLINDER, (0.045, 0.060, 0.0), (0.0, 0.0, 0.260)), 0.1),  # the flowers
    ),
)

BOOKS = Thing(
    mass=1.5,
    looks=tuple(
        primitive
        for z, half, colour in ((0.014, 0.014, BLUE), (0.041, 0.013, RED), (0.066, 0.012, OCHRE))
        for primitive in (
            Primitive(BOX, (0.055, 0.080, half), (0.0, 0.0, z), colour),
            Primitive(BOX, (0.0550, 0.076, half - 0.003), (-0.003, 0.0, z), CREAM),  # the pages
        )
    ),
    touch=((Primitive(BOX, (0.057, 0.080, 0.039), (0.0, 0.0, 0.039)), 1.0),),
)

LAMP = Thing(
    mass=1.2,
    looks=(
        Primitive(CYLINDER, (0.055, 0.008, 0.0), (0.0, 0.0, 0.008), BRASS),
        Primitive(ELLIPSOID, (0.030, 0.030, 0.045), (0.0, 0.0, 0.058), BRASS),
        Primitive(CYLINDER, (0.008, 0.070, 0.0), (0.0, 0.0, 0.150), BRASS),
        Primitive(CYLINDER, (0.075, 0.050, 0.0), (0.0, 0.0, 0.260), CREAM),  # shade
        Primitive(CYLINDER, (0.077, 0.004, 0.0), (0.0, 0.0, 0.213), BRASS),
        Primitive(CYLINDER, (0.077, 0.004, 0.0), (0.0, 0.0, 0.307), BRASS),
    ),
    touch=(
        (Primitive(CYLINDER, (0.055, 0.008, 0.0), (0.0, 0.0, 0.008)), 0.75),
        (Primitive(CYLINDER, (0.020, 0.098, 0.0), (0.0, 0.0, 0.114)), 0.15),
        (Primitive(CYLINDER, (0.077, 0.051, 0.0), (0.0, 0.0, 0.260)), 0.10),
    ),
)


@dataclass(frozen=True)
class Sideboard:
    """A closed cabinet with two doors; its front faces the robot (-x)."""

    front: float = 0.24  # x of the front
    depth: float = 0.71
    width: float = 0.72
    height: float = 0.30  # z of the top

    def add(self, spec: mujoco.MjSpec, name: str, material: str, inner: str) -> mujoco.MjsBody:
        """Add the sideboard, fixed to the world; its doors have the ``inner`` material."""
        body = spec.worldbody.add_body(name=name)
        half, board, overhang = self.height / 2, 0.01, 0.01
        centre = self.front + self.depth / 2
        case = (self.depth / 2 - overhang, self.width / 2 - overhang, half - board)
        top = (self.depth / 2, self.width / 2, board)
        body.add_geom(name=f"{name}_case", type=BOX, size=case, pos=(centre, 0, case[2]), material=material)
        body.add_geom(name=f"{name}_top", type=BOX, size=top, pos=(centre, 0, self.height - board), material=material)
        seen = {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        for side, y in (("left", self.width / 4), ("right", -self.width / 4)):
            door, knob = (0.006, self.width / 4 - 0.02, half - 0.03), (self.front, y - np.sign(y) * 0.11, half)
            body.add_geom(
                name=f"{name}_{side}_door", type=BOX, size=door, pos=(knob[0] + 0.008, y, half), material=inner, **seen
            )
            body.add_geom(
                name=f"{name}_{side}_knob", type=ELLIPSOID, size=(0.01, 0.012, 0.012), pos=knob, rgba=BRASS, **seen
            )
        return body
