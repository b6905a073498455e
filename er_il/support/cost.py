"""Cost of work: time on the clock and on processors."""

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass


@dataclass
class Cost:
    """Seconds that something took."""

    wall: float = 0.0  # [s]
    cpu: float = 0.0  # [s] of this process and of the processes that it started and waited for


@contextmanager
def measured() -> Iterator[Cost]:
    """Measure a block; the cost is known when it ends."""
    cost, wall, cpu = Cost(), time.monotonic(), _cpu()
    try:
        yield cost
    finally:
        cost.wall, cost.cpu = time.monotonic() - wall, _cpu() - cpu


def _cpu() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system
