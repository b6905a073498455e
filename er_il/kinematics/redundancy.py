"""Redundancy: what an action says beyond the end-effector pose, as a function of the joints (paper IV).

An ER action space is a pose and a redundancy. The solver, the spaces, the adviser and the round-trip checks know
a redundancy by this interface alone; a further ER space is one more implementation of it.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.support.errors import UnknownNameError

Array = NDArray[np.float64]


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

    @abstractmethod
    def linearise(self, q: Vector) -> Linearisation:
        """Values and scaled derivative at q (n,) [rad]."""

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
class JointAngle(Redundancy):
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
        return tuple(f"{joint}.pos" for joint in self.joints)

    @cached_property
    def held(self) -> tuple[int, ...]:
        return tuple(self.arm.joints.index(joint) for joint in self.joints)

    def along(self, q: Array) -> Array:
        return q[:, self.held]

    def linearise(self, q: Vector) -> Linearisation:
        held = list(self.held)
        return Linearisation(q[held], 1.0, np.eye(self.arm.dof)[held])
