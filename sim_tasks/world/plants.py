"""Potted plants; see :mod:`sim_tasks.world.household` for their frames."""

from sim_tasks.world.household import CYLINDER, ELLIPSOID, LEAF, SOIL, TERRACOTTA, Primitive, Rgba, Thing

PALE_LEAF: Rgba = (0.46, 0.62, 0.28, 1.0)
POT_RADIUS, POT_HEIGHT = 0.060, 0.140  # [m]
TALL_PLANT_HEIGHT = 0.720  # [m]
LEAVES_RADIUS = 0.040  # [m] of the cylinder that the leaves fill


def tall_plant() -> Thing:
    """A snake plant of ``TALL_PLANT_HEIGHT`` in a pot: upright leaves in a narrow bunch."""
    half, middle = (TALL_PLANT_HEIGHT - POT_HEIGHT) / 2, (TALL_PLANT_HEIGHT + POT_HEIGHT) / 2
    leaves = (
        # centre x, y, share of the height, turn about x, y [deg], colour
        (0.000, 0.000, 1.00, 0.0, 0.0, LEAF),
        (0.013, 0.006, 0.92, -1.0, 1.0, PALE_LEAF),
        (-0.011, 0.011, 0.86, -1.0, -1.0, LEAF),
        (0.003, -0.015, 0.90, 1.0, 0.0, PALE_LEAF),
        (-0.013, -0.010, 0.70, 1.0, -1.5, LEAF),
        (0.015, -0.010, 0.62, 1.0, 1.5, LEAF),
    )
    return Thing(
        mass=3.0,
        looks=(
            Primitive(CYLINDER, (POT_RADIUS - 0.006, POT_HEIGHT / 2, 0.0), (0.0, 0.0, POT_HEIGHT / 2), TERRACOTTA),
            Primitive(CYLINDER, (POT_RADIUS, 0.014, 0.0), (0.0, 0.0, POT_HEIGHT - 0.014), TERRACOTTA),
            Primitive(CYLINDER, (POT_RADIUS - 0.008, 0.001, 0.0), (0.0, 0.0, POT_HEIGHT), SOIL),
            *(
                Primitive(
                    ELLIPSOID,
                    (0.006, 0.021, share * half + 0.01),
                    (x, y, POT_HEIGHT - 0.01 + share * half),
                    colour,
                    (about_x, about_y, 25.0 * number),
                )
                for number, (x, y, share, about_x, about_y, colour) in enumerate(leaves)
            ),
        ),
        touch=(
            (Primitive(CYLINDER, (POT_RADIUS, POT_HEIGHT / 2, 0.0), (0.0, 0.0, POT_HEIGHT / 2)), 0.9),
            (Primitive(CYLINDER, (LEAVES_RADIUS, half, 0.0), (0.0, 0.0, middle)), 0.1),
        ),
    )
