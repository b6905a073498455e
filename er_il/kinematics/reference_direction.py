"""Reference directions of the arm angle: from which direction across the shoulder-wrist axis it is counted.

A reference is a function of the axis's direction alone: the generalised shoulder-elbow-wrist angle of Elias and Wen,
"Redundancy parameterization and inverse kinematics of 7-DOF revolute manipulators" (2023, arXiv 2307.13122). None is
continuous for all directions, for it would be a field of tangents on a sphere.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from er_il.kinematics.components import Components, at_least, cross, dot, length, minus, select, times

VERTICAL = 1e-3  # [rad] closer than this to the vertical, the axis counts as vertical
TINY = 1e-9  # keeps divisions finite in the singular directions


class CircleAxes(NamedTuple):
    """Axes of the circle about one shoulder-wrist axis (numbers), or about N (arrays (N,))."""

    top: Components  # unit vector across the axis, from which the angle is counted
    side: Components  # unit vector a quarter of a turn farther
    spin: Components  # derivative of the turn of ``top`` about the axis by the axis


class ReferenceDirection(Protocol):
    """A direction across the shoulder-wrist axis as a function of that axis."""

    def of(self, axis: Components, xp: Any = math) -> CircleAxes:
        """The reference for a unit vector from shoulder to wrist.

        Args:
            axis: In the base frame; numbers or arrays (N,).
            xp: Functions for their type: ``math``, or an array library.
        """
        ...

    def details(self) -> dict[str, Any]:
        """What a specification says of it, as JSON; nothing for the paper's own."""
        ...


@dataclass(frozen=True)
class Up:
    """The highest point of the elbow's circle (the paper's ERA, IV-B); singular where the axis is vertical.

    Within ``VERTICAL`` of the vertical the base frame's x is meant instead of its z, which keeps the angle finite; it
    jumps on the way in and out, so an arm should not work there.
    """

    def of(self, axis: Components, xp: Any = math) -> CircleAxes:
        x, y, z = axis
        upright = x * x + y * y <= VERTICAL**2
        rise = select(upright, x, z, xp)
        from_top = select(upright, 1.0, 0.0, xp), 0.0 * rise, select(upright, 0.0, 1.0, xp)
        projected = minus(from_top, times(rise, axis))
        top = times(1.0 / length(projected, xp), projected)
        side = cross(axis, top)
        return CircleAxes(top, side, times(-rise / xp.sqrt(at_least(TINY, 1.0 - rise * rise, xp)), side))

    def details(self) -> dict[str, Any]:
        return {}


@dataclass(frozen=True)
class Stereographic:
    """The stereographic projection of one direction (Elias and Wen, section 3.3); singular along one half-line.

    The plane's parallel field along ``e_r`` is projected to the sphere of axes from its point ``e_t``. By default the
    half-line goes straight down from the shoulder, where an upright arm has its own pedestal, and ``e_r`` is such that
    the reference is :class:`Up`'s wherever the wrist is ahead of the base, in its plane y = 0.
    """

    e_t: Components = (0.0, 0.0, -1.0)  # unit vector: the only singular direction
    e_r: Components = (-1.0, 0.0, 0.0)  # unit vector across it: the reference for the axis opposite to ``e_t``

    def of(self, axis: Components, xp: Any = math) -> CircleAxes:
        way = minus(axis, self.e_t)
        gap = at_least(TINY, 0.5 * dot(way, way), xp)  # 1 - axis.e_t
        top = minus(self.e_r, times(dot(self.e_r, axis) / gap, way))
        return CircleAxes(top, cross(axis, top), times(1.0 / gap, cross(self.e_t, axis)))

    def details(self) -> dict[str, Any]:
        return {"e_t": list(self.e_t), "e_r": list(self.e_r)}
