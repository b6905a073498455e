"""A crumpled sheet of paper and a tomato, as free things; see :mod:`sim_tasks.world.household` for their frames."""

from sim_tasks.world.household import ELLIPSOID, LEAF, Primitive, Thing
from sim_tasks.world.props import BOX, CYLINDER

PAPER, SHADE, FOLD = (0.97, 0.97, 0.95, 1.0), (0.86, 0.87, 0.88, 1.0), (0.93, 0.92, 0.89, 1.0)
TOMATO_RED = (0.82, 0.13, 0.08, 1.0)

PAPER_MIDDLE = 0.028  # [m] height of the paper ball's middle
TOMATO_MIDDLE = 0.027

# Upright cylinders touch: the fingers find them alike from every side, and standing they do not roll away.
CRUMPLED_PAPER = Thing(
    mass=0.03,
    looks=tuple(
        Primitive(BOX, size, (x, y, PAPER_MIDDLE + z), rgba, turn)
        for size, (x, y, z), rgba, turn in (
            ((0.022, 0.020, 0.018), (0.000, 0.000, 0.000), PAPER, (20.0, 35.0, 10.0)),
            ((0.020, 0.017, 0.019), (0.003, -0.003, 0.002), SHADE, (65.0, 15.0, 50.0)),
            ((0.019, 0.021, 0.016), (-0.004, 0.002, 0.001), PAPER, (40.0, 70.0, 80.0)),
            ((0.018, 0.016, 0.020), (0.002, 0.005, -0.003), FOLD, (80.0, 50.0, 25.0)),
            ((0.021, 0.015, 0.017), (0.004, 0.001, 0.004), PAPER, (10.0, 80.0, 65.0)),
            ((0.026, 0.010, 0.008), (-0.002, -0.004, 0.006), SHADE, (30.0, 20.0, 35.0)),
            ((0.009, 0.025, 0.010), (0.001, 0.003, 0.003), FOLD, (55.0, 40.0, 15.0)),
            ((0.008, 0.011, 0.026), (-0.001, 0.001, 0.000), PAPER, (15.0, 30.0, 70.0)),
        )
    ),
    touch=((Primitive(CYLINDER, (0.028, 0.027, 0.0), (0.0, 0.0, 0.027)), 1.0),),
    rolling=0.01,
)

TOMATO = Thing(
    mass=0.12,
    looks=(
        Primitive(ELLIPSOID, (0.032, 0.032, 0.027), (0.0, 0.0, TOMATO_MIDDLE), TOMATO_RED),
        *(
            Primitive(ELLIPSOID, (0.018, 0.004, 0.002), (0.0, 0.0, 0.0535), LEAF, (0.0, 0.0, turn))
            for turn in (0.0, 60.0, 120.0)
        ),
        Primitive(CYLINDER, (0.002, 0.006, 0.0), (0.0, 0.0, 0.059), LEAF),
    ),
    touch=((Primitive(CYLINDER, (0.030, 0.026, 0.0), (0.0, 0.0, 0.026)), 1.0),),
    rolling=0.001,
)
