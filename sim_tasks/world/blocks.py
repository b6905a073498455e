"""Wooden building blocks, as free things."""

from sim_tasks.world.household import Primitive, Rgba, Thing
from sim_tasks.world.props import BOX

BLOCK = 0.05  # [m] side


def block(colour: Rgba) -> Thing:
    """A cube that the fingers can take however it is turned."""
    half = BLOCK / 2
    size, centre = (half, half, half), (0.0, 0.0, half)
    return Thing(
        mass=0.08,
        looks=(Primitive(BOX, size, centre, colour),),
        touch=((Primitive(BOX, size, centre), 1.0),),
    )
