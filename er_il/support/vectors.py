"""Vectors of named numbers as callers give them, checked where they enter."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from er_il.support.errors import NumbersError, ShapeError

Array = NDArray[np.float64]
Vector = Array


def named_vector(what: str, given: object, names: Sequence[str]) -> Vector:
    """The vector (len(names),) of real numbers that a caller gave; they may be NaN or infinite.

    Args:
        what: What the caller calls it, such as "The action".
        given: An array, tensor or sequence.
        names: Names of its dimensions.

    Raises:
        NumbersError: it holds anything but real numbers.
        ShapeError: it has another shape.
    """
    return number_array(what, given, (len(names),), ", ".join(names))


def number_array(what: str, given: object, shape: tuple[int, ...], contents: str) -> Array:
    """The array of real numbers that a caller gave, of a shape that holds certain contents; else as named_vector."""
    expected = f"{shape}: {contents}"
    try:
        array = np.asarray(given)
    except (TypeError, ValueError) as error:  # lists of different lengths, a tensor on a GPU
        raise NumbersError(f"{what} is no array of numbers ({error}), expected {expected}.") from error
    if array.dtype.kind not in "fiu":
        kind = type(given).__name__ if array.ndim == 0 else array.dtype.name
        raise NumbersError(f"{what} holds no real numbers but {kind}, expected {expected}.")
    if array.shape != shape:
        raise ShapeError(what, array.shape, expected)
    return array.astype(np.float64, copy=False)


def check_bounds(
    what: str, vector: Vector, names: Sequence[str], lower: Vector, upper: Vector, slack: float = 0.0
) -> None:
    """Refuse a vector (k,) with values that are not finite, or more than ``slack`` outside of bounds (k,).

    Raises:
        NumbersError: names the values and their bounds.
    """
    inside = (vector >= lower - slack) & (vector <= upper + slack)  # NaN is in no range
    if bad := np.flatnonzero(~inside).tolist():
        listed = ", ".join(f"{names[i]} is {vector[i]:g}, expected {lower[i]:g} to {upper[i]:g}" for i in bad)
        raise NumbersError(f"{what} is refused: {listed}.")
