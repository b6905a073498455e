"""End-effector poses as datasets write them: a position, then a rotation in one of many codes."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from er_il.kinematics.rotation import Rot6d

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]

MILLIMETRES = 5.0  # positions whose median is farther from their origin than this are no metres
UNIT = 0.05  # by which lengths and products of unit vectors may miss theirs: single precision, interpolation
TURN = 2 * np.pi + 1e-3  # [rad] no angle is written larger
SOUND = 0.95  # share of the rows that must be rotations


@dataclass(frozen=True)
class PoseCode:
    """A way to write a pose as ``width`` numbers."""

    name: str
    width: int
    _decode: Callable[[Array], tuple[Array, Array]]  # rotations (N, 3, 3), positions (N, 3) [m or mm]

    def decode(self, values: Array) -> Array | None:
        """Poses (N, 4, 4) [m] from numbers (N, width); NaN in rows that are none, None if many are not."""
        sound: Rows = np.asarray(np.isfinite(values).all(axis=1))
        T = np.full((len(values), 4, 4), np.nan)
        R, p = self._decode(np.where(sound[:, None], values, 0.0))
        sound &= np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < UNIT
        sound &= np.linalg.det(R) > 0
        if sound.mean() < SOUND:
            return None
        U, _, Vt = np.linalg.svd(R[sound])
        scale = 1e-3 if np.median(np.linalg.norm(p[sound], axis=1)) > MILLIMETRES else 1.0
        T[sound] = np.eye(4)
        T[sound, :3, :3], T[sound, :3, 3] = U @ Vt, scale * p[sound]
        return T


def _after_position(rotations: Callable[[Array], Array]) -> Callable[[Array], tuple[Array, Array]]:
    return lambda values: (rotations(values[:, 3:]), values[:, :3])


def _euler(order: str, unit: float = 1.0) -> Callable[[Array], Array]:
    def rotations(angles: Array) -> Array:
        turns = unit * angles
        R = Rotation.from_euler(order, turns).as_matrix()
        return _only(R, np.abs(turns).max(axis=1) <= TURN)

    return rotations


def _rotation_vectors(vectors: Array) -> Array:
    return _only(Rotation.from_rotvec(vectors).as_matrix(), np.linalg.norm(vectors, axis=1) <= TURN)


def _quaternions(order: list[int]) -> Callable[[Array], Array]:
    def rotations(values: Array) -> Array:
        norm = np.linalg.norm(values, axis=1)
        unit = np.abs(norm - 1.0) < UNIT
        return _only(Rotation.from_quat(np.where(unit[:, None], values, (0, 0, 0, 1))[:, order]).as_matrix(), unit)

    return rotations


def _six_numbers(by_rows: bool) -> Callable[[Array], Array]:
    def rotations(values: Array) -> Array:
        lengths = np.linalg.norm(values.reshape(-1, 2, 3), axis=2)
        R = Rot6d().decode_batch(values.T, np)[0].transpose(2, 0, 1)
        return _only(R.transpose(0, 2, 1) if by_rows else R, np.abs(lengths - 1.0).max(axis=1) < UNIT)

    return rotations


def _matrices(by_columns: bool) -> Callable[[Array], Array]:
    return lambda values: values.reshape(-1, 3, 3).transpose(0, 2, 1) if by_columns else values.reshape(-1, 3, 3)


def _transforms(by_columns: bool) -> Callable[[Array], tuple[Array, Array]]:
    def parts(values: Array) -> tuple[Array, Array]:
        T = values.reshape(-1, 4, 4)
        T = T.transpose(0, 2, 1) if by_columns else T
        return _only(T[:, :3, :3], np.abs(T[:, 3] - (0, 0, 0, 1)).max(axis=1) < UNIT), T[:, :3, 3]

    return parts


def _only(R: Array, rows: Rows) -> Array:
    """The rotations of some rows; zero matrices, which are none, elsewhere."""
    return np.where(rows[:, None, None], R, 0.0)


DEGREE = np.pi / 180.0
CODES = (
    PoseCode("roll, pitch, yaw (about fixed x, y, z) in rad", 6, _after_position(_euler("xyz"))),
    PoseCode("roll, pitch, yaw (about fixed x, y, z) in degrees", 6, _after_position(_euler("xyz", DEGREE))),
    PoseCode("Euler angles about moving x, y, z in rad", 6, _after_position(_euler("XYZ"))),
    PoseCode("Euler angles about moving x, y, z in degrees", 6, _after_position(_euler("XYZ", DEGREE))),
    PoseCode("yaw, pitch, roll (about moving z, y, x) in rad", 6, _after_position(_euler("ZYX"))),
    PoseCode("yaw, pitch, roll (about moving z, y, x) in degrees", 6, _after_position(_euler("ZYX", DEGREE))),
    PoseCode("rotation vector", 6, _after_position(_rotation_vectors)),
    PoseCode("quaternion x, y, z, w", 7, _after_position(_quaternions([0, 1, 2, 3]))),
    PoseCode("quaternion w, x, y, z", 7, _after_position(_quaternions([1, 2, 3, 0]))),
    PoseCode("rotation matrix by rows", 12, _after_position(_matrices(by_columns=False))),
    PoseCode("rotation matrix by columns", 12, _after_position(_matrices(by_columns=True))),
    # after the matrices, which begin with the same numbers
    PoseCode("rot6d by columns", 9, _after_position(_six_numbers(by_rows=False))),
    PoseCode("rot6d by rows", 9, _after_position(_six_numbers(by_rows=True))),
    PoseCode("4 x 4 matrix by rows", 16, _transforms(by_columns=False)),
    PoseCode("4 x 4 matrix by columns", 16, _transforms(by_columns=True)),
)
