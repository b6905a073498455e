"""Jobs in processes: results, progress and errors are those of one process."""

import math
import os

import pytest

from er_il.support.workers import run_jobs


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_order_with_each_told_as_done(workers: int) -> None:
    told: list[tuple[int, int]] = []
    roots = run_jobs([(math.sqrt, x) for x in (9.0, 4.0, 1.0)], workers, lambda *done: told.append(done))
    assert roots == [3.0, 2.0, 1.0]
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_only_several_workers_are_other_processes() -> None:
    here = os.getpid()
    assert run_jobs([(os.getpid,)] * 2, 1, lambda *_: None) == [here, here]
    assert here not in run_jobs([(os.getpid,)] * 2, 2, lambda *_: None)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_job_is_the_caller_s(workers: int) -> None:
    with pytest.raises(ValueError, match=r"math domain error|nonnegative"):
        run_jobs([(math.sqrt, 4.0), (math.sqrt, -1.0)], workers, lambda *_: None)
