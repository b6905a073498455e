"""Vectors in three dimensions as their components: numbers, or arrays of any library for many vectors at once.

For one vector this takes a tenth of the time that arrays of three elements take, and the same formulas serve both.
"""

import math
from typing import Any

type Components = tuple[Any, Any, Any]  # x, y, z


def plus(a: Components, b: Components) -> Components:
    """The sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def minus(a: Components, b: Components) -> Components:
    """The difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def times(factor: Any, a: Components) -> Components:
    """The multiple."""
    return factor * a[0], factor * a[1], factor * a[2]


def dot(a: Components, b: Components) -> Any:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Components, b: Components) -> Components:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a: Components, xp: Any) -> Any:
    """The Euclidean norm; ``xp``: functions for the components' type, ``math`` or an array library."""
    return xp.sqrt(dot(a, a))


def select(condition: Any, yes: Any, no: Any, xp: Any) -> Any:
    """One of two values by a condition."""
    return (yes if condition else no) if xp is math else xp.where(condition, yes, no)


def at_least(least: float, value: Any, xp: Any) -> Any:
    """The value, or ``least`` where it is smaller."""
    return select(value < least, least, value, xp)
