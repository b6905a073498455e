"""Rotations as numbers a policy can learn: unit quaternions, or the first two columns or rows of the matrix (6D).

Quaternions are (x, y, z, w). q and -q are the same rotation, and a policy that sees both for one
orientation learns their useless mean. :class:`Quaternion` therefore has a reference orientation:
the first quaternion of a trajectory takes the sign nearer to the reference, each later one the
sign nearer to its predecessor. A plain ``w >= 0`` would flip exactly where grippers live: a hand
that points down or forward is about half a turn from the identity.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from er_il.kinematics.components import Components, cross
from er_il.support.errors import UnknownNameError

Array = NDArray[np.float64]
MIN_NORM = 1e-6  # below this length a vector has no direction


class RotationError(ValueError):
    """Numbers that stand for no rotation."""


class RotationCode(ABC):
    """An invertible code of rotation matrices as vectors."""

    kind: ClassVar[str]
    names: ClassVar[tuple[str, ...]]

    @abstractmethod
    def encode(self, R: Array) -> Array:
        """Encode trajectories of rotation matrices (..., N, 3, 3), one or many at once, as (..., N, len(names))."""

    @abstractmethod
    def decode(self, code: Array) -> Array:
        """Return the rotation matrix (3, 3) nearest to a code (len(names),).

        Raises:
            RotationError: the code stands for no rotation (zero or degenerate).
        """

    @abstractmethod
    def decode_batch(self, code: Any, xp: Any) -> tuple[Any, Any]:
        """Decode many codes at once.

        Args:
            code: (len(names), N), an array of the library ``xp``.

        Returns:
            Rotation matrices (3, 3, N), and a mask (N,) of the codes that stand for one.
        """


@dataclass(frozen=True)
class Quaternion(RotationCode):
    """Unit quaternion (x, y, z, w), sign-continuous along a trajectory."""

    reference: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    kind = "quat"
    names = ("ee.qx", "ee.qy", "ee.qz", "ee.qw")

    def encode(self, R: Array) -> Array:
        quaternions = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat().reshape(*R.shape[:-2], 4)
        first = np.broadcast_to(self.reference, (*R.shape[:-3], 1, 4))
        previous = np.concatenate([first, quaternions[..., :-1, :]], axis=-2)
        turns = np.where(np.sum(previous * quaternions, axis=-1) < 0, -1.0, 1.0)
        return quaternions * np.cumprod(turns, axis=-1)[..., None]

    def decode(self, code: Array) -> Array:
        x, y, z, w = code.tolist()
        norm = math.sqrt(x * x + y * y + z * z + w * w)
        if norm < MIN_NORM:
            raise RotationError("a zero quaternion is no rotation")
        return np.array(quaternion_rows(x / norm, y / norm, z / norm, w / norm))

    def decode_batch(self, code: Any, xp: Any) -> tuple[Any, Any]:
        norm = xp.sqrt(xp.sum(code * code, axis=0))
        rotates = norm >= MIN_NORM
        rows = quaternion_rows(*(code / xp.where(rotates, norm, 1.0)))
        return xp.stack([xp.stack(row, axis=0) for row in rows], axis=0), rotates


@dataclass(frozen=True)
class Rot6d(RotationCode):
    """First two columns of the rotation matrix, continuous everywhere (Zhou et al. 2019)."""

    kind = "rot6d"
    names = ("ee.r11", "ee.r21", "ee.r31", "ee.r12", "ee.r22", "ee.r32")

    def encode(self, R: Array) -> Array:
        return R[..., :2].swapaxes(-2, -1).reshape(*R.shape[:-2], 6)

    def decode(self, code: Array) -> Array:
        x = _unit(code[:3])
        y = _unit(code[3:] - x * (x @ code[3:]))
        return np.column_stack([x, y, cross(x.tolist(), y.tolist())])

    def decode_batch(self, code: Any, xp: Any) -> tuple[Any, Any]:
        x, straight = _units(code[:3], xp)
        y, across = _units(code[3:] - x * xp.sum(x * code[3:], axis=0), xp)
        return xp.stack([x, y, xp.stack(cross(tuple(x), tuple(y)), axis=0)], axis=1), straight & across


@dataclass(frozen=True)
class Rot6dRows(RotationCode):
    """First two rows of the rotation matrix: the same numbers as the columns of its inverse.

    Many data sets call these the 6D rotation, such as those that were written with PyTorch3D.
    """

    kind = "rot6d_rows"
    names = ("ee.r11", "ee.r12", "ee.r13", "ee.r21", "ee.r22", "ee.r23")

    def encode(self, R: Array) -> Array:
        return R[..., :2, :].reshape(*R.shape[:-2], 6)

    def decode(self, code: Array) -> Array:
        return _BY_COLUMNS.decode(code).T

    def decode_batch(self, code: Any, xp: Any) -> tuple[Any, Any]:
        R, rotates = _BY_COLUMNS.decode_batch(code, xp)
        return xp.permute_dims(R, (1, 0, 2)), rotates


_BY_COLUMNS = Rot6d()
ROTATIONS = (Quaternion.kind, Rot6d.kind, Rot6dRows.kind)


def _units(v: Any, xp: Any) -> tuple[Any, Any]:
    """Vectors (3, N) of length one, and a mask (N,) of those that have a direction."""
    norm = xp.sqrt(xp.sum(v * v, axis=0))
    directed = norm >= MIN_NORM
    return v / xp.where(directed, norm, 1.0), directed


def quaternion_rows(x: Any, y: Any, z: Any, w: Any) -> tuple[Components, Components, Components]:
    """Rows of the rotation matrix of a unit quaternion: numbers, or arrays (N,) for N quaternions."""
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def turn_by(w: Array) -> Array:
    """The rotation matrix (3, 3) of a rotation vector w (3,) [rad]."""
    return pin.exp3(w)


def _unit(v: Array) -> Array:
    norm = float(np.linalg.norm(v))
    if norm < MIN_NORM:
        raise RotationError("the two axes are zero or parallel")
    return np.asarray(v / norm, dtype=np.float64)


def make_rotation(kind: str, reference: Array) -> RotationCode:
    """Build a rotation code by name; ``reference`` (3, 3) fixes the quaternion's hemisphere.

    Raises:
        UnknownNameError: no code has that name.
    """
    if kind == Quaternion.kind:
        x, y, z, w = Rotation.from_matrix(reference).as_quat().tolist()
        return Quaternion((x, y, z, w))
    if kind == Rot6d.kind:
        return _BY_COLUMNS
    if kind == Rot6dRows.kind:
        return Rot6dRows()
    raise UnknownNameError("rotation", kind, ROTATIONS)
