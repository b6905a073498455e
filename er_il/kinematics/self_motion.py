"""The arm's self-motion, the joint velocities that leave the end effector still, and how well a redundancy sees it."""

import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.redundancy import Array, Redundancy
from er_il.kinematics.solver import kinematics_of


def self_motions(arm: Arm, q: Array) -> Array:
    """Orthonormal rows (N, n-6, n) that span the self-motion at q (N, n) [rad]; their signs mean nothing."""
    return np.linalg.svd(kinematics_of(arm).jacobians(q))[2][:, arm.dof - arm.redundancy :]


def margins(redundancy: Redundancy, q: Array) -> Vector:
    """Margins (N,) of a redundancy from its folds at q (N, n) [rad], in [0, 1].

    The margin is the cosine of the largest angle between the self-motion and the directions in which the redundancy
    changes: 1 where it measures the self-motion and nothing else, 0 where a self-motion leaves it still. For ERJ's
    joint i it is |n_i| of the unit self-motion n, for ERX's w.q it is |w.n|.
    """
    derivative = redundancy.linearise_batch(kinematics_of(redundancy.arm).chain.walk(q))[2]  # (m, n, N)
    directions = np.linalg.qr(derivative.transpose(2, 1, 0))[0]  # (N, n, m)
    cosines = np.linalg.svd(self_motions(redundancy.arm, q) @ directions, compute_uv=False)
    return np.asarray(np.clip(cosines[:, -1], 0.0, 1.0), dtype=np.float64)
