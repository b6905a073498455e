"""Contacts between groups of bodies."""

from collections.abc import Collection, Iterator
from itertools import product

import mujoco
import numpy as np

FAR = 10.0  # [m] up to which distances are measured


def touching(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> bool:
    """True if any body of one group touches any body of the other."""
    return next(_between(model, data, one, other), None) is not None


def touches_shapes(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Collection[int], shapes: Collection[int]
) -> bool:
    """True if any body of a group touches any of the shapes."""
    one, other = data.contact.geom.T
    others = np.concatenate([one[np.isin(other, list(shapes))], other[np.isin(one, list(shapes))]])
    return bool(np.isin(model.geom_bodyid[others], list(bodies)).any())


def contact_force(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> float:
    """Sum of the contact forces' magnitudes [N] between two groups of bodies."""
    total, force = 0.0, np.zeros(6)
    for index in _between(model, data, one, other):
        mujoco.mj_contactForce(model, data, index, force)
        total += float(np.linalg.norm(force[:3]))
    return total


def collision_geoms(model: mujoco.MjModel, bodies: Collection[int]) -> tuple[int, ...]:
    """Ids of the collision shapes of a group of bodies."""
    collides = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return tuple(np.flatnonzero(collides & np.isin(model.geom_bodyid, list(bodies))).tolist())


def distance(
    model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int], most: float = FAR
) -> float:
    """Smallest distance [m] between two groups of shapes, at most ``most``, negative if they overlap."""
    pairs = product(one, other)
    return min((mujoco.mj_geomDistance(model, data, a, b, most, None) for a, b in pairs), default=most)


def _between(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> Iterator[int]:
    bodies = model.geom_bodyid[data.contact.geom]
    for index, (a, b) in enumerate(bodies.reshape(-1, 2)):
        if (a in one and b in other) or (b in one and a in other):
            yield index
