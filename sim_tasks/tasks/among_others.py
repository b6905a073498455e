"""Placements of a target among other things of its kind."""

from collections.abc import Sequence

import numpy as np

from sim_tasks.tasks.placement import Placement


def draw_among_others(
    rng: np.random.Generator,
    target: str,
    others: Sequence[str],
    centre: tuple[float, float],
    sides: tuple[float, float],
    distances: tuple[float, float],
    yaw: float,
) -> Placement:
    """Draw places of a target in a rectangle and of one or two others beside it.

    Args:
        rng: Source of the random numbers.
        target: Name of the target.
        others: Names of the others; seen from the target, two are at least 90 degrees apart.
        centre: (x, y) [m] of the rectangle.
        sides: Its sides [m].
        distances: Smallest and largest distance [m] of the others from the target.
        yaw: Everything is turned up to this far [rad] to either side.
    """
    x, y = np.array(centre) + (rng.random(2) - 0.5) * sides
    placement: Placement = {target: (x, y, rng.uniform(-yaw, yaw))}
    direction = rng.uniform(0.0, 2 * np.pi)
    for name in others:
        distance = rng.uniform(*distances)
        place = x + distance * np.cos(direction), y + distance * np.sin(direction)
        placement[name] = (*place, rng.uniform(-yaw, yaw))
        direction += rng.uniform(0.5 * np.pi, 1.5 * np.pi)
    return placement
