"""Bottles and cups, as free things; see :mod:`sim_tasks.world.household` for their frames."""

from sim_tasks.world.household import ELLIPSOID, Primitive, Rgba, Thing
from sim_tasks.world.props import CYLINDER

GREEN_GLASS, LABEL, CORK = (0.10, 0.32, 0.16, 1.0), (0.93, 0.88, 0.74, 1.0), (0.62, 0.44, 0.26, 1.0)
COFFEE, CUP_BLUE = (0.20, 0.11, 0.05, 1.0), (0.15, 0.45, 0.90, 1.0)

BOTTLE_RADIUS, BOTTLE_HEIGHT = 0.030, 0.240  # [m]
CUP_RADIUS, CUP_HEIGHT = 0.033, 0.100  # [m]


def bottle(glass: Rgba = GREEN_GLASS, cap: Rgba = CORK) -> Thing:
    """A wine bottle of ``BOTTLE_HEIGHT``: body, shoulder, neck."""
    body, neck = 0.075, 0.040  # [m] half heights
    return Thing(
        mass=0.3,
        looks=(
            Primitive(CYLINDER, (BOTTLE_RADIUS, body, 0.0), (0.0, 0.0, body), glass),
            Primitive(CYLINDER, (BOTTLE_RADIUS + 0.0005, 0.028, 0.0), (0.0, 0.0, 0.070), LABEL),
            Primitive(ELLIPSOID, (BOTTLE_RADIUS, BOTTLE_RADIUS, 0.030), (0.0, 0.0, 2 * body), glass),
            Primitive(CYLINDER, (0.011, neck, 0.0), (0.0, 0.0, BOTTLE_HEIGHT - neck), glass),
            Primitive(CYLINDER, (0.012, 0.012, 0.0), (0.0, 0.0, BOTTLE_HEIGHT - 0.012), cap),
        ),
        touch=(
            (Primitive(CYLINDER, (BOTTLE_RADIUS, body, 0.0), (0.0, 0.0, body)), 0.85),
            (Primitive(CYLINDER, (0.012, neck, 0.0), (0.0, 0.0, BOTTLE_HEIGHT - neck)), 0.15),
        ),
    )


def cup(colour: Rgba = CUP_BLUE, inside: Rgba = COFFEE) -> Thing:
    """A cup without a handle, ``CUP_HEIGHT`` high, narrow enough for the fingers."""
    half = CUP_HEIGHT / 2
    return Thing(
        mass=0.15,
        looks=(
            Primitive(CYLINDER, (CUP_RADIUS, half, 0.0), (0.0, 0.0, half), colour),
            Primitive(CYLINDER, (CUP_RADIUS - 0.004, 0.001, 0.0), (0.0, 0.0, CUP_HEIGHT), inside),
        ),
        touch=((Primitive(CYLINDER, (CUP_RADIUS, half, 0.0), (0.0, 0.0, half)), 1.0),),
    )
