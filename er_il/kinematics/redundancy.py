"""Redundancy: what an action says beyond the end-effector pose, as a function of the joints (paper IV).

An ER action space is a pose and a redundancy. The solver, the spaces, the adviser and the round-trip checks know
a redundancy by this interface alone; a further ER space is one more implementation of it.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import array_api_compat as array_api
import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.chain import Walk, constant
from er_il.kinematics.components import Components
from er_il.kinematics.forward import ForwardKinematics, forward_of
from er_il.support.errors import UnknownNameError

Array = NDArray[np.float64]


class Slope(NamedTuple):
    """A redundancy and its scaled derivative, at one configuration (numbers) or at N (arrays (N,) of any library).

    The derivative is taken by the origins of the redundancy's links, or by the joints, or is the sum of both.
    """

    values: Sequence[Any]  # m values [rad]
    scale: Any  # see Linearisation
    by_points: Sequence[Sequence[Components]] = ()  # for each value, one for each link
    by_joints: Array | None = None  # (m, n) constant


class Linearisation(NamedTuple):
    """A redundancy at one configuration, scaled so that its errors weigh like errors of the pose.

    ``scale`` is the length [m] that a radian of the value is worth. The scaled derivative may be finite where the
    derivative is not: at the pole of an angle the scale vanishes.
    """

    values: Vector  # (m,)
    scale: float  # [m/rad] or 1
    derivative: Array  # (m, n) scale times the derivative of the values by the joints


@dataclass(frozen=True, eq=False)
class Redundancy(ABC):
    """m values of an arm's n joints, m = n - 6 for an ER space."""

    arm: Arm

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the m values."""

    @cached_property
    def held(self) -> tuple[int, ...]:
        """Indices of the joints that are the values themselves: the solver eliminates them; () if there are none."""
        return ()

    @abstractmethod
    def along(self, q: Array) -> Array:
        """Values (N, m) [rad] along a trajectory q (N, n) [rad] in time order, continuous in time."""

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the links whose origins the values depend on."""
        return ()

    @abstractmethod
    def slope(self, q: Sequence[Any], points: Sequence[Components], xp: Any = math) -> Slope:
        """Values and their derivative.

        Args:
            q: The n joint angles [rad], numbers or arrays (N,).
            points: Origins of the links ``frames`` [m] in the base frame, of the same type.
            xp: Functions for the type: ``math``, or an array library.
        """

    def linearise(self, q: Vector) -> Linearisation:
        """Values and scaled derivative at q (n,) [rad]."""
        points = self._forward.points(q, self.frames) if self.frames else None
        at = self.slope(q.tolist(), points.origins if points else ())
        derivative = at.by_joints
        if points:
            by_points = np.array([points.slope(weights) for weights in at.by_points])
            derivative = by_points if derivative is None else derivative + by_points
        assert derivative is not None
        return Linearisation(np.array(at.values), at.scale, derivative)

    def linearise_batch(self, walk: Walk) -> tuple[Any, Any, Any]:
        """Values (m, N) [rad], scale and scaled derivative (m, n, N) at the configurations of a walk."""
        xp = array_api.array_namespace(walk.q)
        links = [self._forward.mounted(frame) for frame in self.frames]
        at = self.slope(tuple(walk.q.T), [walk.point(link) for link in links], xp)
        rows = []
        for i in range(len(at.values)):
            row = 0.0 if at.by_joints is None else constant(at.by_joints[i, :, None], walk.q)
            rows.append(row + walk.slope(links, at.by_points[i]) if links else row + 0.0 * walk.q.T)
        return xp.stack(tuple(at.values), axis=0), at.scale, xp.stack(rows, axis=0)

    @cached_property
    def _forward(self) -> ForwardKinematics:
        return forward_of(self.arm)

    def difference(self, start: Vector, end: Vector) -> Vector:
        """The shortest change (m,) [rad] that leads from values ``start`` to values ``end``."""
        return end - start

    def fitted(self, postures: Array) -> Self:
        """The same redundancy with the conventions (such as a reference turn) that suit postures (N, n) [rad]."""
        return self

    def details(self) -> dict[str, Any]:
        """The redundancy's part of a specification, as JSON."""
        return {}

    def restored(self, spec: Mapping[str, Any]) -> Self:
        """The same redundancy with the conventions of a specification.

        Raises:
            KeyError: the specification is incomplete.
            SpecError: it measures something else.
        """
        return self


@dataclass(frozen=True, eq=False)
class LinearRedundancy(Redundancy):
    """Values W q that are linear in the joints, with orthonormal rows of W."""

    @cached_property
    @abstractmethod
    def weights(self) -> Array:
        """W (m, n), which is the values' derivative everywhere."""

    @cached_property
    def _rows(self) -> list[list[float]]:
        return self.weights.tolist()

    def along(self, q: Array) -> Array:
        return q @ self.weights.T

    def slope(self, q: Sequence[Any], points: Sequence[Components], xp: Any = math) -> Slope:
        values = [sum(weight * angle for weight, angle in zip(row, q, strict=True) if weight) for row in self._rows]
        return Slope(values, 1.0, by_joints=self.weights)

    def moved(self, q: Array, change: Array) -> Array:
        """Angles (..., n) [rad] after the smallest change of q (..., n) that changes the values by (..., m) [rad]."""
        return q + change @ self.weights


@dataclass(frozen=True, eq=False)
class JointAngle(LinearRedundancy):
    """The angles of chosen joints (ERJ, paper IV-C); inverse kinematics solves the others.

    Raises:
        UnknownNameError: the arm has no such joint.
    """

    joints: tuple[str, ...]

    def __post_init__(self) -> None:
        for joint in self.joints:
            if joint not in self.arm.joints:
                raise UnknownNameError("joint", joint, self.arm.joints)

    @property
    def names(self) -> tuple[str, ...]:
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return tuple(f"{joint}.pos" for joint in self.joints)

    @cached_property
    def held(self) -> tuple[int, ...]:
        return tuple(self.arm.joints.index(joint) for joint in self.joints)

    @cached_property
    def weights(self) -> Array:
        return np.eye(self.arm.dof)[list(self.held)]
