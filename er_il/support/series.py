"""Series of numbers, summarised for reports."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def percentiles(values: NDArray[np.float64], shares: Sequence[int]) -> dict[str, float]:
    """Percentiles of values as JSON, such as ``p50``; empty if there are no values."""
    if not len(values):
        return {}
    return {f"p{share}": float(value) for share, value in zip(shares, np.percentile(values, shares), strict=True)}


def stretches(flags: NDArray[np.bool_]) -> list[list[int]]:
    """First and last index of each stretch of flags (T,) that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [[int(first), int(stop) - 1] for first, stop in edges.reshape(-1, 2)]
