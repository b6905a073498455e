"""Questions about contacts between groups of bodies."""

from collections.abc import Collection, Iterator

import mujoco
import numpy as np


def touching(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> bool:
    """Whether any body of one group touches any body of the other."""
    return next(_between(model, data, one, other), None) is not None


def contact_force(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> float:
    """Sum of the contact forces' magnitudes [N] between two groups of bodies."""
    total, force = 0.0, np.zeros(6)
    for index in _between(model, data, one, other):
        mujoco.mj_contactForce(model, data, index, force)
        total += float(np.linalg.norm(force[:3]))
    return total


def _between(model: mujoco.MjModel, data: mujoco.MjData, one: Collection[int], other: Collection[int]) -> Iterator[int]:
    bodies = model.geom_bodyid[data.contact.geom]
    for index, (a, b) in enumerate(bodies.reshape(-1, 2)):
        if (a in one and b in other) or (b in one and a in other):
            yield index
