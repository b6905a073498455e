"""Forward kinematics of many configurations at once, on arrays of NumPy, PyTorch or another array library.

Arrays are batch-last: a rotation of N configurations is (3, 3, N), so that every operation runs over all of them.
Every joint turns about its own z here; the constant rotations that this takes are part of the placements.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import array_api_compat as array_api
import numpy as np
from numpy.typing import NDArray

from er_il.kinematics.components import Components, cross, dot, minus

Array = NDArray[np.float64]
CHUNK = 2048  # configurations at once: their arrays stay in the processor's cache


class Placement(NamedTuple):
    """Constant placement in the frame of the joint before, the base's if there is none."""

    R: Array  # (3, 3)
    p: Array  # (3,) [m]


class Mounted(NamedTuple):
    """A link's frame on a chain."""

    joints: int  # number of joints between it and the base
    placement: Placement


@dataclass(frozen=True, eq=False)
class Chain:
    """The joints from an arm's base to its end effector, base first."""

    order: tuple[int, ...]  # each joint's index in the arm's vectors
    placements: tuple[Placement, ...]

    def walk(self, q: Any) -> "Walk":
        """Place all joints at q (N, n) [rad], an array of any library."""
        xp = array_api.array_namespace(q)
        angles = q.T
        R, p = constant(np.eye(3)[..., None], q), constant(np.zeros((3, 1)), q)
        frames = [(R, p)]
        for index, placement in zip(self.order, self.placements, strict=True):
            R, p = _placed(R, p, placement, q)
            c, s = xp.cos(angles[index]), xp.sin(angles[index])
            x, y, z = R[:, 0], R[:, 1], R[:, 2]
            R = xp.stack([x * c + y * s, y * c - x * s, xp.broadcast_to(z, (3, len(q)))], axis=1)
            frames.append((R, p))
        return Walk(self, q, tuple(frames))


@dataclass(frozen=True, eq=False)
class Walk:
    """The joints of N configurations, in the base frame."""

    chain: Chain
    q: Any  # (N, n) [rad]
    frames: tuple[
        tuple[Any, Any], ...
    ]  # rotation (3, 3, N) and origin (3, N or 1) [m] of the base and behind each joint

    def pose(self, link: Mounted) -> tuple[Any, Any]:
        """Rotation (3, 3, N) and origin (3, N) [m] of a link."""
        return _placed(*self.frames[link.joints], link.placement, self.q)

    def point(self, link: Mounted) -> Components:
        """Origin of a link [m], its components (N,)."""
        return tuple(self.pose(link)[1])

    @cached_property
    def axes(self) -> list[Components]:
        """Axis of each joint of the chain."""
        return [tuple(R[:, 2]) for R, _ in self.frames[1:]]

    @cached_property
    def origins(self) -> list[Components]:
        """Origin of each joint of the chain [m]."""
        return [tuple(p) for _, p in self.frames[1:]]

    def jacobian(self, link: Mounted) -> Any:
        """Geometric Jacobian (6, n, N) of a link: linear rows [m/rad], then angular ones [rad/rad]."""
        p = self.point(link)
        zero = 0.0 * p[0]
        columns: list[list[Any]] = [[zero] * 6] * len(self.chain.order)
        for at, index in enumerate(self.chain.order[: link.joints]):
            axis = self.axes[at]
            columns[index] = [*cross(axis, minus(p, self.origins[at])), *axis]
        return self._rows(zip(*columns, strict=True))

    def slope(self, links: Sequence[Mounted], weights: Sequence[Components]) -> Any:
        """Derivative (n, N) of the sum of weights times the links' origins by the joints, the weights held."""
        columns: list[Any] = [0.0 * weights[0][0]] * len(self.chain.order)
        for link, weight in zip(links, weights, strict=True):
            p = self.point(link)
            for at, index in enumerate(self.chain.order[: link.joints]):
                columns[index] = columns[index] + dot(cross(self.axes[at], minus(p, self.origins[at])), weight)
        return self._rows([columns])[0]

    def _rows(self, rows: Any) -> Any:
        xp = array_api.array_namespace(self.q)
        size = (len(self.q),)
        return xp.stack([xp.stack([xp.broadcast_to(each, size) for each in row], axis=0) for row in rows], axis=0)


def _placed(R: Any, p: Any, placement: Placement, like: Any) -> tuple[Any, Any]:
    """A placement (3, 3, N), (3, N) followed by a constant one."""
    xp = array_api.array_namespace(like)
    moved = p + xp.matmul(constant(placement.p[None], like), R)[:, 0]
    return xp.matmul(constant(placement.R.T, like), R), moved


def chunks(length: int) -> Iterator[slice]:
    """Slices of at most ``CHUNK`` rows."""
    return (slice(start, min(start + CHUNK, length)) for start in range(0, length, CHUNK))


def detached(values: Any) -> Any:
    """An array without its history of automatic differentiation."""
    return values.detach() if array_api.is_torch_array(values) else values


def to_numpy(values: Any) -> NDArray[Any]:
    """An array of any library, on any device, as one of NumPy."""
    return detached(values).cpu().numpy() if array_api.is_torch_array(values) else np.asarray(values)


def constant(value: Array, like: Any) -> Any:
    """A constant as an array of the type and on the device of another."""
    return array_api.array_namespace(like).asarray(value, dtype=like.dtype, device=array_api.device(like))
