"""What the search for joint angles is asked for, and what it answers."""

from typing import NamedTuple

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.redundancy import Array, Redundancy

POSITION_TOLERANCE = 1e-4  # [m]
ROTATION_TOLERANCE = 1e-3  # [rad]


class Goal(NamedTuple):
    """A pose and, if commanded, redundancy values to reach."""

    T_base_ee: Array  # (4, 4)
    redundancy: Redundancy | None = None
    values: Vector = np.zeros(0)  # (m,) of the redundancy

    @property
    def held(self) -> tuple[int, ...]:
        """Indices of the joints that stay where the start has them."""
        return () if self.redundancy is None else self.redundancy.held

    @property
    def equations(self) -> int:
        """Number of equations that the redundancy adds to the pose's; held joints are eliminated instead."""
        return 0 if self.redundancy is None or self.held else len(self.redundancy.names)


class Miss(NamedTuple):
    """Errors of joint angles with respect to a goal."""

    position: float  # [m]
    rotation: float  # [rad]
    size: float  # norm of what the QP corrects, the redundancy scaled to lengths
    redundancy: float = 0.0  # [rad] of the worst redundancy value
    equations: tuple[Array, Vector] | None = None  # scaled derivative (m, n) [m/rad], and the lengths to go (m,) [m]


class Attempt(NamedTuple):
    """Result of a run of iterations."""

    q: Vector  # (n,) [rad]
    miss: Miss
    moving: bool  # it was still getting closer
    clear: bool = False  # no fold is near

    @property
    def reached(self) -> bool:
        """True if the goal is met within tolerance."""
        angle = max(self.miss.rotation, self.miss.redundancy)
        return self.miss.position <= POSITION_TOLERANCE and angle <= ROTATION_TOLERANCE
