"""Jobs in processes: results, progress and errors are those of one process."""

import math
import os

import pytest

from er_il.support.workers import StatefulWorkers, run_jobs


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


@pytest.mark.parametrize("count", [1, 2])
def test_each_worker_makes_its_state_once(count: int) -> None:
    with StatefulWorkers(count, list) as workers:
        results = [workers.submit(appended, x) for x in range(6)]
        lengths = [result() for result in results]
    made_here = os.getpid() in {process for process, _ in lengths}
    assert made_here == (count == 1)
    for process in {process for process, _ in lengths}:
        own = [length for each, length in lengths if each == process]
        assert own == list(range(1, len(own) + 1))


def test_a_single_worker_does_nothing_before_it_is_asked() -> None:
    made: list[int] = []
    with StatefulWorkers(1, lambda: made.append(1) or made) as workers:
        first, _ = workers.submit(appended, 2), workers.submit(appended, 3)
        assert made == []
        first()
    assert made == [1, 2]


def appended(state: list[int], x: int) -> tuple[int, int]:
    state.append(x)
    return os.getpid(), len(state)
