"""Aggregates over a suite of tasks (Agarwal et al. 2021, arXiv 2108.13264): IQM with stratified bootstrap intervals."""

import numpy as np
from numpy.typing import NDArray

from er_il.evaluation.statistics import LEVEL
from er_il.support.errors import ErIlError

Array = NDArray[np.float64]

RESAMPLES = 5000


def interquartile_mean(scores: Array) -> float:
    """Mean of the middle half of all runs (N, M): of N trainings on each of M tasks, together.

    Raises:
        ErIlError: there are no runs.
    """
    return float(_interquartile_means(_checked(scores)[None])[0])


def stratified_interval(scores: Array, level: float = LEVEL, seed: int = 0) -> tuple[float, float]:
    """Percentile interval of the interquartile mean: trainings are drawn again, with replacement, task by task.

    Args:
        scores: Runs (N, M): of N trainings on each of M tasks.
        level: Confidence level.
        seed: Of the draws.

    Raises:
        ErIlError: there are no runs.
    """
    runs, tasks = _checked(scores).shape
    rng = np.random.default_rng(seed)
    drawn = rng.integers(runs, size=(RESAMPLES, runs, tasks))
    means = _interquartile_means(scores[drawn, np.arange(tasks)])
    low, high = np.quantile(means, [0.5 - level / 2, 0.5 + level / 2])
    return float(low), float(high)


def _interquartile_means(samples: Array) -> Array:
    """Of each sample (K, N, M)."""
    ordered = np.sort(samples.reshape(len(samples), -1), axis=1)
    cut = ordered.shape[1] // 4
    return ordered[:, cut : ordered.shape[1] - cut].mean(axis=1)


def _checked(scores: Array) -> Array:
    if scores.ndim != 2 or not scores.size:
        raise ErIlError(f"Scores of shape {scores.shape} are none of runs on tasks.")
    return scores
