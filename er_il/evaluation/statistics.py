"""Intervals for success rates: exact, and paired where two decoders met the same initial states."""

import math
from collections.abc import Sequence

from er_il.support.errors import ErIlError

LEVEL = 0.95


def exact_interval(successes: int, episodes: int, level: float = LEVEL) -> tuple[float, float]:
    """Clopper-Pearson interval of a success rate.

    Raises:
        ErIlError: no episodes, or more successes than episodes.
    """
    if not 0 <= successes <= episodes or episodes < 1:
        raise ErIlError(f"{successes} successes in {episodes} episodes have no rate.")
    from scipy.stats import binomtest  # a second of imports, which reports without rates do without

    interval = binomtest(successes, episodes).proportion_ci(confidence_level=level, method="exact")
    return float(interval.low), float(interval.high)


def paired_difference(a: Sequence[bool], b: Sequence[bool], level: float = LEVEL) -> tuple[float, float, float]:
    """Difference of two success rates over the same episodes, with its interval.

    Bonett and Price's adjusted Wald interval for paired proportions (2012), which only the episodes
    on which a and b differ can widen.

    Args:
        a: Success of each episode.
        b: Success of the same episodes, in the same order.
        level: Confidence level.

    Returns:
        Rate of a minus rate of b, lower and upper bound.

    Raises:
        ErIlError: no episodes, or not the same number.
    """
    n = len(a)
    if n != len(b) or n < 1:
        raise ErIlError(f"{n} and {len(b)} episodes cannot be paired.")
    a_only = sum(1 for x, y in zip(a, b, strict=True) if x and not y)
    b_only = sum(1 for x, y in zip(a, b, strict=True) if y and not x)
    p_a, p_b = (a_only + 1) / (n + 2), (b_only + 1) / (n + 2)
    from scipy.stats import norm

    half = float(norm.ppf(0.5 + level / 2)) * math.sqrt((p_a + p_b - (p_a - p_b) ** 2) / (n + 2))
    centre = p_a - p_b
    return (a_only - b_only) / n, max(-1.0, centre - half), min(1.0, centre + half)
