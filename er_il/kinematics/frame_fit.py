"""The constant frames between recorded end-effector poses B and those of forward kinematics A: B_i = Y A_i X.

X = ``T_ee_recorded`` is what was recorded as end effector, seen from the URDF's; Y = ``T_recorded_base`` the URDF's
base in the frame that poses were recorded in. (Robot-world and hand-eye calibration, A X = Y B, has Y inverted.)

Not all motions determine both: with rotations about one axis only, X and Y can be traded for one another along it. But
either follows from the other in closed form. So the simplest hypothesis is taken that explains the poses about as well
as any: a known base frame and any X; a known end-effector frame and any Y; both unknown.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Vector = NDArray[np.float64]

LENGTH = 0.2  # [m] that weighs as much as 1 rad
SHARE = 90  # percentile of the residuals that hypotheses are compared by: some rows may be off
SIMPLER, SLACK = 1.5, 5e-4  # a simpler hypothesis may leave so many times as much as the best, and [m] more
KEPT = 80  # percentile of the residuals beyond which rows are left out of a second solution
GLITCH = 0.01  # [m] residuals beyond count less and less
SEEN = 0.02  # a change of the frames that moves the poses by less than this share of it is not determined


@dataclass(frozen=True, eq=False)
class FrameFit:
    """The frames, and what they leave unexplained of N poses."""

    T_recorded_base: Array  # (4, 4)
    T_ee_recorded: Array  # (4, 4)
    base: str  # known frame that the poses were taken to be recorded in; "" if it was fitted
    ee: str  # likewise of the end effector
    undetermined: int  # of the twelve numbers of both frames, that the motion says nothing about

    def residuals(self, A: Array, B: Array) -> tuple[Vector, Vector]:
        """Distances (N,) [m] and angles (N,) [rad] between Y A X and B, both (N, 4, 4)."""
        found = self.T_recorded_base @ A @ self.T_ee_recorded
        chord = np.linalg.norm(found[:, :3, :3] - B[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
        return np.linalg.norm(found[:, :3, 3] - B[:, :3, 3], axis=1), 2.0 * np.arcsin(np.minimum(chord, 1.0))

    def size(self, A: Array, B: Array) -> float:
        """What hypotheses are compared by [m]."""
        return _at_share(self.weighed(A, B), SHARE)

    def weighed(self, A: Array, B: Array) -> Vector:
        """Distances and angles (N,) [m] in one."""
        distance, angle = self.residuals(A, B)
        return np.hypot(distance, LENGTH * angle)


def fit_frames(A: Array, B: Array, bases: Mapping[str, Array], ees: Mapping[str, Array], refine: bool) -> FrameFit:
    """Fit Y and X in B = Y A X.

    Args:
        A: (N, 4, 4) ``T_base_ee`` by forward kinematics.
        B: (N, 4, 4) recorded poses.
        bases: ``T_frame_base`` (4, 4) of frames that poses may have been recorded in.
        ees: ``T_ee_frame`` (4, 4) of frames that may have been recorded.
        refine: Follow the closed form by robust least squares.
    """
    levels = (
        [FrameFit(Y, _right(A, B, Y), name, "", 0) for name, Y in bases.items()],
        [FrameFit(_left(A, B, X), X, "", name, 0) for name, X in ees.items()],
        _both(A, B),
    )
    best = [min(level, key=lambda fit: fit.size(A, B)) for level in levels]
    if refine:
        best = [_refined(fit, A, B) for fit in best]
    sizes = [fit.size(A, B) for fit in best]
    return next(fit for fit, size in zip(best, sizes, strict=True) if size <= SIMPLER * min(sizes) + SLACK)


def inverse(T: Array) -> Array:
    """Inverse of transforms (..., 4, 4)."""
    found = np.zeros_like(T)
    found[..., :3, :3] = np.swapaxes(T[..., :3, :3], -1, -2)
    found[..., :3, 3] = -(found[..., :3, :3] @ T[..., :3, 3, None])[..., 0]
    found[..., 3, 3] = 1.0
    return found


def _right(A: Array, B: Array, Y: Array) -> Array:
    """X for a given Y."""
    X = inverse(Y @ A) @ B
    return _transform(_mean_rotation(X[:, :3, :3]), np.median(X[:, :3, 3], axis=0))


def _left(A: Array, B: Array, X: Array) -> Array:
    """Y for a given X."""
    AX = A @ X
    R = _mean_rotation(B[:, :3, :3] @ AX[:, :3, :3].transpose(0, 2, 1))
    return _transform(R, np.median(B[:, :3, 3] - AX[:, :3, 3] @ R.T, axis=0))


def _both(A: Array, B: Array) -> list[FrameFit]:
    """Both frames, from several rotations of Y: one that fits the rotations, one that fits the positions, and none."""
    found = []
    for R_Y in _turns(A, B):
        fit = _with_turn(A, B, R_Y)
        size = fit.weighed(A, B)
        kept = size <= _at_share(size, KEPT)  # least squares once more without what may be off
        found.append(_with_turn(A[kept], B[kept], R_Y))
    return found


def _turns(A: Array, B: Array) -> list[Array]:
    # Shah (2013): the first left singular vector of the sum of kron(R_B, R_A) is R_Y, up to its length and sign.
    K = np.einsum("nij,nkl->ikjl", B[:, :3, :3], A[:, :3, :3]).reshape(9, 9)
    R_Y = np.linalg.svd(K)[0][:, 0].reshape(3, 3)
    R_Y = R_Y * np.sign(np.linalg.det(R_Y))
    a, b = (T[:, :3, 3] - np.median(T[:, :3, 3], axis=0) for T in (A, B))
    return [_nearest_rotation(R_Y), _nearest_rotation(b.T @ a), np.eye(3)]


def _with_turn(A: Array, B: Array, R_Y: Array) -> FrameFit:
    """Y with a given rotation, and X."""
    R = R_Y @ A[:, :3, :3]
    R_X = _mean_rotation(R.transpose(0, 2, 1) @ B[:, :3, :3])
    # p_B - R_Y p_A = R_Y R_A p_X + p_Y: the shortest solution, where there are many
    columns = np.concatenate([R, np.broadcast_to(np.eye(3), R.shape)], axis=2).reshape(-1, 6)
    p = np.asarray(np.linalg.lstsq(columns, (B[:, :3, 3] - A[:, :3, 3] @ R_Y.T).ravel(), rcond=SEEN)[0], np.float64)
    return FrameFit(_transform(R_Y, p[3:]), _transform(R_X, p[:3]), "", "", 0)


def _refined(fit: FrameFit, A: Array, B: Array) -> FrameFit:
    """A fit after robust least squares over what is not known of it."""
    free = (not fit.base, not fit.ee)

    def moved(change: Vector) -> FrameFit:
        steps = iter(change.reshape(-1, 6))
        Y = _step(next(steps)) @ fit.T_recorded_base if free[0] else fit.T_recorded_base
        X = fit.T_ee_recorded @ _step(next(steps)) if free[1] else fit.T_ee_recorded
        return FrameFit(Y, X, fit.base, fit.ee, 0)

    def errors(change: Vector) -> Vector:
        at = moved(change)
        found = at.T_recorded_base @ A @ at.T_ee_recorded
        turns = Rotation.from_matrix(found[:, :3, :3].transpose(0, 2, 1) @ B[:, :3, :3]).as_rotvec()
        return np.concatenate([found[:, :3, 3] - B[:, :3, 3], LENGTH * turns], axis=1).ravel()

    solved = least_squares(errors, np.zeros(6 * sum(free)), loss="soft_l1", f_scale=GLITCH, x_scale=1.0)
    # Where a frame is not determined, steps along it mean nothing: the start stays, which is the shortest.
    values, axes = np.linalg.svd(solved.jac, full_matrices=False)[1:]
    seen = values > SEEN * np.sqrt(len(A))
    end = moved(axes[seen].T @ (axes[seen] @ solved.x))
    undetermined = int((~seen).sum())
    better = end if end.size(A, B) <= fit.size(A, B) else fit
    return FrameFit(better.T_recorded_base, better.T_ee_recorded, fit.base, fit.ee, undetermined)


def _step(change: Vector) -> Array:
    """A small transform from a rotation vector, as lengths, and a translation (6,) [m]."""
    return _transform(Rotation.from_rotvec(change[:3] / LENGTH).as_matrix(), change[3:])


def _at_share(values: Vector, share: int) -> float:
    """A percentile, without the interpolation that takes NumPy longer than all else here."""
    return float(np.sort(values)[share * (len(values) - 1) // 100])


def _mean_rotation(R: Array) -> Array:
    return _nearest_rotation(R.sum(axis=0))


def _nearest_rotation(M: Array) -> Array:
    U, _, Vt = np.linalg.svd(M)
    return U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt


def _transform(R: Array, p: Vector) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T
