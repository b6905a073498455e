"""Counted reasons as text."""

from collections import Counter
from collections.abc import Mapping


def tally(reasons: Mapping[str, int]) -> str:
    """Return counted reasons, the most common first: ``no plan 3, timeout 1``."""
    return ", ".join(f"{reason} {count}" for reason, count in Counter(reasons).most_common())
