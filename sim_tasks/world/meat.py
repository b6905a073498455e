"""Pieces of meat for the grill, as free things; see :mod:`sim_tasks.world.household` for their frames.

Both are longest along x, and narrow enough for the fingers across it.
"""

from sim_tasks.world.household import ELLIPSOID, Primitive, Rgba, Thing
from sim_tasks.world.props import BOX, CAPSULE, CYLINDER

BEEF, SEARED, FAT, BONE = (
    (0.45, 0.17, 0.11, 1.0),
    (0.16, 0.07, 0.05, 1.0),
    (0.93, 0.82, 0.66, 1.0),
    (0.95, 0.92, 0.84, 1.0),
)
ROAST, CRISP = (0.85, 0.56, 0.20, 1.0), (0.70, 0.40, 0.12, 1.0)

GRASP_HEIGHT = 0.019  # [m] at which the fingers take a piece


def _slab(half_length: float, radius: float, low: float, high: float, rgba: Rgba) -> tuple[Primitive, ...]:
    """A lying slab with round ends."""
    middle, half = (low + high) / 2, (high - low) / 2
    straight = half_length - radius
    return (
        Primitive(BOX, (straight, radius, half), (0.0, 0.0, middle), rgba),
        Primitive(CYLINDER, (radius, half, 0.0), (straight, 0.0, middle), rgba),
        Primitive(CYLINDER, (radius, half, 0.0), (-straight, 0.0, middle), rgba),
    )


STEAK = Thing(
    mass=0.20,
    looks=(
        *_slab(0.055, 0.030, 0.0, 0.026, FAT),
        *_slab(0.052, 0.027, 0.001, 0.029, BEEF),
        *(
            Primitive(BOX, (0.003, 0.025, 0.0008), (x, 0.0, 0.029), SEARED, (0.0, 0.0, 25.0))
            for x in (-0.03, 0.0, 0.03)
        ),
        Primitive(CAPSULE, (0.004, 0.015, 0.0), (0.018, 0.012, 0.028), BONE, (90.0, 0.0, 0.0)),
        Primitive(CAPSULE, (0.004, 0.014, 0.0), (0.018, 0.025, 0.028), BONE, (0.0, 90.0, 0.0)),
    ),
    touch=((Primitive(BOX, (0.050, 0.029, 0.0145), (0.0, 0.0, 0.0145)), 1.0),),
)

CHICKEN = Thing(
    mass=0.25,
    looks=(
        Primitive(ELLIPSOID, (0.050, 0.032, 0.025), (-0.005, 0.0, 0.025), ROAST),  # the body
        Primitive(ELLIPSOID, (0.030, 0.024, 0.016), (-0.018, 0.0, 0.037), ROAST),  # the breast
        *(
            primitive
            for side in (-1.0, 1.0)
            for primitive in (
                Primitive(
                    ELLIPSOID, (0.030, 0.013, 0.014), (0.020, 0.019 * side, 0.028), CRISP, (0.0, -15.0, -8.0 * side)
                ),
                Primitive(CAPSULE, (0.0045, 0.012, 0.0), (0.052, 0.016 * side, 0.036), BONE, (0.0, 75.0, 0.0)),
                Primitive(ELLIPSOID, (0.007, 0.007, 0.007), (0.064, 0.016 * side, 0.039), BONE),
                Primitive(ELLIPSOID, (0.018, 0.007, 0.011), (-0.022, 0.029 * side, 0.024), CRISP, (0.0, 20.0, 0.0)),
            )
        ),
    ),
    touch=((Primitive(BOX, (0.050, 0.029, 0.022), (0.0, 0.0, 0.022)), 1.0),),
)
