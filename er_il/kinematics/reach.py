"""Reach of an arm: from where, and how far, its end effector gets."""

from functools import lru_cache

import numpy as np
from scipy.optimize import minimize

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.forward import forward_of

SAMPLES = 4096  # configurations among which the stretched arm is looked for,
BEST = 4  # the best of which are improved
DIGITS = 6  # of a reach [m]: arms of one geometry have one reach
PARALLEL = 1e-6  # sine of the angle below which two axes have no nearest points


@lru_cache
def shoulder(arm: Arm) -> Vector:
    """The shoulder (3,) [m] in the base frame: on the first joint's axis, the point nearest the second joint's.

    It is where they intersect, on nearly all arms, and stays where it is whatever the joints do. Where the two are
    parallel, or there is but one, it is the first joint's origin.
    """
    walk = forward_of(arm).chain.walk(np.zeros((1, arm.dof)))
    origins, axes = (np.array(each)[:, :, 0] for each in (walk.origins, walk.axes))
    if arm.dof < 2 or (sine := np.linalg.norm(np.cross(axes[0], axes[1]))) < PARALLEL:
        return origins[0]
    across = np.cross(axes[0], axes[1]) / sine
    way = np.cross(origins[1] - origins[0], axes[1]) @ across / sine
    return origins[0] + way * axes[0]


@lru_cache
def reach(arm: Arm) -> float:
    """The greatest distance [m] of the end effector from :func:`shoulder` within the joint limits."""
    kinematics, centre = forward_of(arm), shoulder(arm)
    shares = np.random.default_rng(0).random((SAMPLES, arm.dof))
    q = arm.lower + (arm.upper - arm.lower) * shares
    distances = np.linalg.norm(kinematics.fk_batch(q)[:, :3, 3] - centre, axis=1)

    def shortfall(angles: Vector) -> tuple[float, Vector]:
        way = kinematics.fk(angles)[:3, 3] - centre
        distance = float(np.linalg.norm(way))
        return -distance, -(way / distance) @ kinematics.jacobian(angles)[:3]

    bounds = list(zip(arm.lower, arm.upper, strict=True))
    starts = q[np.argsort(-distances)[:BEST]]
    found = max(-float(minimize(shortfall, start, jac=True, bounds=bounds).fun) for start in starts)
    return round(found, DIGITS)
