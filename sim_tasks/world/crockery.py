"""A mug with a handle and a plate; see :mod:`sim_tasks.world.household` for the mug's frame."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.household import CREAM, CYLINDER, Primitive, Rgba, Thing
from sim_tasks.world.props import CAPSULE
from sim_tasks.world.tableware import COFFEE

MUG_RADIUS, MUG_HEIGHT = 0.032, 0.090  # [m] narrow enough for the fingers
MUG_RED: Rgba = (0.80, 0.22, 0.16, 1.0)


def mug(colour: Rgba = MUG_RED) -> Thing:
    """A mug of coffee, its handle along +x; the handle is only seen."""
    half, out = MUG_HEIGHT / 2, MUG_RADIUS + 0.024
    bar = 0.005  # [m] radius of the handle
    return Thing(
        mass=0.25,
        looks=(
            Primitive(CYLINDER, (MUG_RADIUS, half, 0.0), (0.0, 0.0, half), colour),
            Primitive(CYLINDER, (MUG_RADIUS - 0.004, 0.001, 0.0), (0.0, 0.0, MUG_HEIGHT), COFFEE),
            Primitive(CAPSULE, (bar, 0.018, 0.0), (out, 0.0, half), colour),
            Primitive(CAPSULE, (bar, 0.012, 0.0), (MUG_RADIUS + 0.012, 0.0, half + 0.018), colour, (0.0, 90.0, 0.0)),
            Primitive(CAPSULE, (bar, 0.012, 0.0), (MUG_RADIUS + 0.012, 0.0, half - 0.018), colour, (0.0, 90.0, 0.0)),
        ),
        touch=((Primitive(CYLINDER, (MUG_RADIUS, half, 0.0), (0.0, 0.0, half)), 1.0),),
    )


@dataclass(frozen=True)
class Plate:
    """A round plate, a mocap body whose origin is the middle of its underside."""

    radius: float = 0.085
    height: float = 0.010  # of what stands on it

    def add(self, spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
        """Add the plate."""
        body = spec.worldbody.add_body(name=name, mocap=True)
        half, seen = self.height / 2, {"mass": 0, "contype": 0, "conaffinity": 0, "group": 2}
        body.add_geom(type=CYLINDER, size=(self.radius - 0.02, half, 0.0), pos=(0.0, 0.0, half), rgba=CREAM)
        # The rim stands out a little higher than the middle, and is only seen.
        for radius, z in ((self.radius, 0.004), (self.radius - 0.004, 0.002)):
            body.add_geom(type=CYLINDER, size=(radius, 0.002, 0.0), pos=(0.0, 0.0, z + 0.002), rgba=CREAM, **seen)
        return body
