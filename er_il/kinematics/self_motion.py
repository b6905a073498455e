"""Self-motion: what a redundant arm can do while its end effector stays, and how well a redundancy sees it."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

from er_il.arms.arm import POSE_DOF, Arm, Vector
from er_il.kinematics.forward import ForwardKinematics
from er_il.kinematics.redundancy import Array, Redundancy
from er_il.kinematics.solver import kinematics_of

CORRECTIONS = 2  # Newton's steps back to the pose after each step along the tangent
OFF = 1e-3  # [m and rad] a walk that is still so far from the pose has come to the end of what is reachable
STEP = 0.05  # [rad] of the walk that measures how far self-motion goes
ROUND = 4 * np.pi  # [rad] self-motion that is longer is walked no farther
LEAST = 1e-9  # [1] keeps the square of a Jacobian invertible


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


def tangents(J: Array) -> Array:
    """Directions (k, n), of unit length, from a configuration along its self-motion, both ways.

    Of a self-motion of one dimension there are two; of more, two along each of its axes. The axes depend on the null
    space alone, not on the basis that a decomposition finds for it, whose signs may differ from machine to machine.

    Args:
        J: (6, n) the end effector's Jacobian.
    """
    P, axes = np.array([_projected(J, column) for column in np.eye(J.shape[1])]), []
    for _ in range(J.shape[1] - POSE_DOF):
        axis = P[np.argmax(np.diag(P))]  # of the joint that the null space turns most
        axes.append(axis / np.linalg.norm(axis))
        P = P - np.outer(P @ axes[-1], axes[-1])
    return np.array([sign * axis for axis in axes for sign in (1.0, -1.0)]).reshape(-1, J.shape[1])


def walk(kinematics: ForwardKinematics, T_base_ee: Array, q: Vector, tangent: Vector, step: float) -> Iterator[Vector]:
    """Walk along the self-motion, until a joint comes to its limit or the self-motion ends in a singularity.

    Args:
        kinematics: The arm's.
        T_base_ee: (4, 4) pose of the end effector, which it keeps.
        q: (n,) [rad] the start, at that pose.
        tangent: (n,) unit direction at the start; the walk goes on straight ahead.
        step: Length [rad] of a step, over all joints.

    Yields:
        Joint angles (n,) [rad] every ``step`` along the walk, the start left out.
    """
    arm = kinematics.arm
    while True:
        q = q + step * tangent
        for _ in range(CORRECTIONS):
            q = q + _least_change(kinematics.jacobian(q), kinematics.pose_gap(T_base_ee, q))
        gap = kinematics.pose_gap(T_base_ee, q)
        if np.any((q < arm.lower) | (q > arm.upper)) or gap @ gap > OFF**2:
            return
        yield q
        ahead = _projected(kinematics.jacobian(q), tangent)
        tangent = ahead / np.linalg.norm(ahead)


def extents(kinematics: ForwardKinematics, q: Vector) -> Vector:
    """How far (n-6,) [rad] the joints can go along each axis of the self-motion from q (n,) [rad], both ways together.

    The length of the way through the joint angles, within the limits; the whole of it where it closes.
    """
    T_base_ee, found = kinematics.fk(q), []
    ways = iter(tangents(kinematics.jacobian(q)))
    for ahead, back in zip(ways, ways, strict=True):
        found.append(STEP * sum(_steps(kinematics, T_base_ee, q, tangent) for tangent in (ahead, back)))
    return np.array(found)


def _steps(kinematics: ForwardKinematics, T_base_ee: Array, q: Vector, tangent: Vector) -> float:
    """Steps of a walk until it ends; half as many where it comes back to its start, as the other way does, too."""
    count = 0
    for count, at in enumerate(islice(walk(kinematics, T_base_ee, q, tangent, STEP), int(ROUND / STEP)), start=1):
        if count > 2 and np.linalg.norm(at - q) < STEP:
            return count / 2
    return count


def _projected(J: Array, change: Vector) -> Vector:
    """A change (n,) of the joints without its part that moves the end effector."""
    return change - _least_change(J, J @ change)


def _least_change(J: Array, motion: Vector) -> Vector:
    """The smallest change (n,) of the joints that moves the end effector by ``motion`` (6,) [m and rad]."""
    return J.T @ np.linalg.solve(J @ J.T + LEAST * np.eye(POSE_DOF), motion)
