"""A mug, a teacup and a plate; see :mod:`sim_tasks.world.household` for frames."""

from dataclasses import dataclass

import mujoco

from sim_tasks.world.household import CREAM, CYLINDER, Primitive, Rgba, Thing
from sim_tasks.world.props import BOX, CAPSULE
from sim_tasks.world.tableware import COFFEE, CUP_BLUE

MUG_RADIUS, MUG_HEIGHT = 0.032, 0.090  # [m] narrow enough for the fingers
TEACUP_RADIUS, TEACUP_HEIGHT = 0.042, 0.068  # [m] wide and low: it slides where a taller cup would tip
MUG_RED: Rgba = (0.80, 0.22, 0.16, 1.0)


def mug(colour: Rgba = MUG_RED) -> Thing:
    """A mug of coffee, its handle along +x; the handle is only seen."""
    return _cup(MUG_RADIUS, MUG_HEIGHT, 0.25, colour)


def teacup(colour: Rgba = CUP_BLUE) -> Thing:
    """A wide cup of coffee, its handle along +x; the handle is only seen."""
    return _cup(TEACUP_RADIUS, TEACUP_HEIGHT, 0.2, colour)


def _cup(radius: float, height: float, mass: float, colour: Rgba) -> Thing:
    half, loop, bar = height / 2, 0.4 * height / 2, 0.005  # [m] half heights of cup and handle, the handle's thickness
    return Thing(
        mass=mass,
        looks=(
            Primitive(CYLINDER, (radius, half, 0.0), (0.0, 0.0, half), colour),
            Primitive(CYLINDER, (radius - 0.004, 0.001, 0.0), (0.0, 0.0, height), COFFEE),
            Primitive(CAPSULE, (bar, loop, 0.0), (radius + 0.024, 0.0, half), colour),
            *(Primitive(BOX, (0.014, bar, bar), (radius + 0.010, 0.0, z), colour) for z in (half - loop, half + loop)),
        ),
        touch=((Primitive(CYLINDER, (radius, half, 0.0), (0.0, 0.0, half)), 1.0),),
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
