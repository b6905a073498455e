"""A folded umbrella, and the stand in which it stands."""

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np

from sim_tasks.world.household import ELLIPSOID, Primitive, Thing
from sim_tasks.world.props import BOX, CAPSULE, CYLINDER

CANOPY, FOLD, STRAP = (0.70, 0.12, 0.16, 1.0), (0.55, 0.08, 0.12, 1.0), (0.20, 0.05, 0.07, 1.0)
METAL, HANDLE = (0.62, 0.64, 0.67, 1.0), (0.45, 0.28, 0.14, 1.0)

HANDLE_HEIGHT = 0.355  # [m] of the middle of the handle's straight part, where fingers find it
_BEND, _BEND_HEIGHT, _HANDLE_RADIUS = 0.026, 0.400, 0.011  # [m] the hook: radius, height of its centre, thickness


def _hook() -> tuple[Primitive, ...]:
    """Half a circle of capsules, open below, from the handle's top forward (x)."""
    angles = np.linspace(np.pi, 0.0, 6)
    ends = np.column_stack([_BEND * (1 + np.cos(angles)), np.zeros(6), _BEND_HEIGHT + _BEND * np.sin(angles)])
    ends = np.vstack([ends, ends[-1] - (0.0, 0.0, 0.012)])
    parts = []
    for one, other in pairwise(ends):
        x, y, z = ((one + other) / 2).tolist()
        dx, _, dz = other - one
        half = float(np.hypot(dx, dz)) / 2
        turn = float(np.degrees(np.arctan2(dx, dz)))
        parts.append(Primitive(CAPSULE, (_HANDLE_RADIUS, half, 0.0), (x, y, z), HANDLE, (0.0, turn, 0.0)))
    return tuple(parts)


# Tip down, as it stands; the hook opens forward (x).
UMBRELLA = Thing(
    mass=0.3,
    looks=(
        Primitive(CYLINDER, (0.004, 0.020, 0.0), (0.0, 0.0, 0.020), METAL),  # ferrule
        Primitive(ELLIPSOID, (0.023, 0.023, 0.145), (0.0, 0.0, 0.165), CANOPY),
        *(
            Primitive(
                ELLIPSOID,
                (0.0035, 0.010, 0.125),
                (0.0205 * np.cos(angle), 0.0205 * np.sin(angle), 0.175),
                FOLD,
                (0.0, 0.0, float(np.degrees(angle))),
            )
            for angle in np.linspace(0, 2 * np.pi, 6, endpoint=False)
        ),
        Primitive(CYLINDER, (0.0245, 0.007, 0.0), (0.0, 0.0, 0.215), STRAP),
        Primitive(CYLINDER, (0.005, 0.020, 0.0), (0.0, 0.0, 0.310), METAL),  # shaft
        Primitive(CAPSULE, (_HANDLE_RADIUS, 0.036, 0.0), (0.0, 0.0, _BEND_HEIGHT - 0.036), HANDLE),
        *_hook(),
    ),
    touch=(
        (Primitive(BOX, (0.009, 0.009, 0.004), (0.0, 0.0, 0.004)), 0.25),  # on which it stands by itself
        (Primitive(CAPSULE, (0.023, 0.120, 0.0), (0.0, 0.0, 0.165)), 0.6),
        (Primitive(CAPSULE, (_HANDLE_RADIUS, 0.055, 0.0), (0.0, 0.0, 0.345)), 0.1),
        (Primitive(BOX, (0.020, 0.009, 0.020), (0.036, 0.0, 0.412)), 0.05),  # the hook
    ),
)


@dataclass(frozen=True)
class UmbrellaStand:
    """A tube on a foot, open above, that can be put anywhere; its origin is the middle of its underside."""

    height: float = 0.19  # of the rim
    floor: float = 0.008  # on which the umbrella stands
    inner: float = 0.036  # from the axis to the middle of each wall
    wall: float = 0.006
    sides: int = 8

    def add(self, spec: mujoco.MjSpec, name: str, material: str, rim: str) -> mujoco.MjsBody:
        """Add the stand as a mocap body; its rim and foot have materials of their own."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        half, middle = self.wall / 2, self.inner + self.wall / 2
        side = (self.inner + self.wall) * np.tan(np.pi / self.sides)
        foot = (self.inner + 0.024, self.floor / 2, 0)
        body.add_geom(type=CYLINDER, size=foot, pos=(0, 0, self.floor / 2), material=rim)
        seen = {"contype": 0, "conaffinity": 0, "group": 2}
        for angle in np.linspace(0, 2 * np.pi, self.sides, endpoint=False):
            x, y = middle * np.cos(angle), middle * np.sin(angle)
            quat = (np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2))
            tall = (self.height - self.floor) / 2
            body.add_geom(
                type=BOX, size=(half, side, tall), pos=(x, y, self.floor + tall), quat=quat, material=material
            )
            for z in (self.floor + 0.010, self.height - 0.006):
                band = (half + 0.002, side + 0.001, 0.006)
                body.add_geom(type=BOX, size=band, pos=(x, y, z), quat=quat, material=rim, **seen)
        return body
