"""Rotations as numbers a policy can learn: unit quaternions, or the first two matrix columns (6D).

Quaternions are (x, y, z, w). q and -q are the same rotation, and a policy that sees both for one
orientation learns their useless mean. :class:`Quaternion` therefore has a reference orientation:
the first quaternion of a trajectory takes the sign nearer to the reference, each later one the
sign nearer to its predecessor. A plain ``w >= 0`` would flip exactly where grippers live: a hand
that points down or forward is about half a turn from the identity.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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
        """Encode a trajectory of rotation matrices (N, 3, 3) as (N, len(names))."""

    @abstractmethod
    def decode(self, code: Array) -> Array:
        """Return the rotation matrix (3, 3) nearest to a code (len(names),).

        Raises:
            RotationError: the code stands for no rotation (zero or degenerate).
        """


@dataclass(frozen=True)
class Quaternion(RotationCode):
    """Unit quaternion (x, y, z, w), sign-continuous along a trajectory."""

    reference: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

    kind = "quat"
    names = ("ee.qx", "ee.qy", "ee.qz", "ee.qw")

    def encode(self, R: Array) -> Array:
        quaternions = Rotation.from_matrix(R).as_quat()
        previous = np.vstack([np.asarray(self.reference)[None], quaternions[:-1]])
        turns = np.where(np.sum(previous * quaternions, axis=1) < 0, -1.0, 1.0)
        return quaternions * np.cumprod(turns)[:, None]

    def decode(self, code: Array) -> Array:
        if np.linalg.norm(code) < MIN_NORM:
            raise RotationError("a zero quaternion is no rotation")
        return Rotation.from_quat(code).as_matrix()


@dataclass(frozen=True)
class Rot6d(RotationCode):
    """First two columns of the rotation matrix, continuous everywhere (Zhou et al. 2019)."""

    kind = "rot6d"
    names = ("ee.r11", "ee.r21", "ee.r31", "ee.r12", "ee.r22", "ee.r32")

    def encode(self, R: Array) -> Array:
        return R[:, :, :2].transpose(0, 2, 1).reshape(-1, 6)

    def decode(self, code: Array) -> Array:
        x = _unit(code[:3])
        y = _unit(code[3:] - x * (x @ code[3:]))
        z = np.asarray(np.cross(x, y), dtype=np.float64)
        return np.column_stack([x, y, z])


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
        return Rot6d()
    raise UnknownNameError("rotation", kind, [Quaternion.kind, Rot6d.kind])
