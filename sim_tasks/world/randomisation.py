"""Validation of the ranges of randomisation, which come from recipes."""

from collections.abc import Sequence

import numpy as np

from er_il.support.errors import RandomisationError

SLOWEST = 0.01  # share of the joints' velocity limits


def span(name: str, value: float) -> float:
    """Return a half range, a number of at least 0; else raise RandomisationError."""
    if _numbers(value, ()) and value >= 0:
        return float(value)
    raise RandomisationError(f"{name} must be a number of at least 0, not {value!r}.")


def sides(name: str, value: Sequence[float]) -> tuple[float, float]:
    """Return the sides of a rectangle, two numbers of at least 0; else raise RandomisationError."""
    if _numbers(value, (2,)) and min(value) >= 0:
        return float(value[0]), float(value[1])
    raise RandomisationError(f"{name} must be two numbers of at least 0, not {value!r}.")


def interval(name: str, value: Sequence[float], least: float = 0.0) -> tuple[float, float]:
    """Return the lowest and highest value of a range, at least ``least``; else raise RandomisationError."""
    if _numbers(value, (2,)) and least <= value[0] <= value[1]:
        return float(value[0]), float(value[1])
    raise RandomisationError(f"{name} must be the lowest and the highest number, at least {least:g}, not {value!r}.")


def _numbers(value: object, shape: tuple[int, ...]) -> bool:
    try:
        array = np.asarray(value)
    except ValueError:  # lists of different lengths
        return False
    return array.shape == shape and array.dtype.kind in "fi" and bool(np.isfinite(array).all())
