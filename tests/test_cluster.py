"""A real Ray cluster: the same jobs, the same results, though a process and a machine die."""

import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest
from file_jobs import FileJob, graph
from ray.cluster_utils import Cluster

from er_il.experiments.cluster import RayExecutor
from er_il.experiments.schedule import Schedule
from er_il.support.errors import ErIlError
from er_il.support.workers import LocalExecutor


def many(folder: Path, sleep: float = 0.5) -> list[FileJob]:
    """Eight jobs, one of which kills its process."""
    jobs = [FileJob(folder / f"extra{i}.json", seed=10 + i, sleep=sleep) for i in range(3)]
    return [*graph(folder, c="die"), *jobs]


def patiently(start: Callable[[], Any]) -> Any:
    """Start a node of the cluster; Ray gives it half a minute, which is little where other tests run beside."""
    for attempts_left in range(4, -1, -1):
        try:
            return start()
        except Exception as error:
            if "timed out during startup" not in str(error) or not attempts_left:
                raise
    return None


@pytest.mark.slow
def test_nothing_is_lost_when_a_process_and_a_machine_die(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))  # the cluster's processes must find these jobs
    # A machine that does not answer is given up after two seconds instead of fifteen.
    health = {"health_check_initial_delay_ms": 1000, "health_check_period_ms": 500, "health_check_failure_threshold": 4}
    head = {"num_cpus": 0, "include_dashboard": False, "_system_config": health}
    cluster = patiently(lambda: Cluster(initialize_head=True, head_node_args=head))
    try:
        patiently(lambda: cluster.add_node(num_cpus=1))
        doomed = patiently(lambda: cluster.add_node(num_cpus=1))
        jobs = many(tmp_path / "cluster")
        schedule = Schedule(jobs)

        def kill() -> None:
            while len([job for job in jobs if job.runs]) < 3 and not over.is_set():
                time.sleep(0.05)
            cluster.remove_node(doomed, allow_graceful=False)

        over = Event()
        killer = Thread(target=kill)
        with RayExecutor(str(cluster.address)) as executor:
            assert executor.workers == 2
            killer.start()
            schedule.run(executor)
            over.set()
            killer.join()
    finally:
        cluster.shutdown()
    assert not schedule.failed
    alone = many(tmp_path / "alone", sleep=0.0)
    with LocalExecutor(2) as executor:
        Schedule(alone).run(executor)
    assert [job.path.read_text() for job in jobs] == [job.path.read_text() for job in alone]


def test_no_cluster_is_one_clear_line() -> None:
    with pytest.raises(ErIlError, match=r"No Ray cluster at 127\.0\.0\.1:1"), RayExecutor("127.0.0.1:1"):
        pass
