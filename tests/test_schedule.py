"""Jobs side by side: nothing is done twice, nothing is lost, a failure stays alone."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
from file_jobs import FileJob, InOrder, graph

from er_il.experiments.schedule import ATTEMPTS, Schedule
from er_il.support.workers import LocalExecutor

TESTS = Path(__file__).parent


def test_needs_come_first_and_what_is_there_is_not_done_again(tmp_path: Path) -> None:
    jobs = graph(tmp_path)
    executor = InOrder()
    Schedule(jobs).run(executor)
    assert executor.ran == ["root", "a", "b", "c", "d"]
    jobs[3].path.unlink()
    jobs[0].needs[0].path.unlink()  # nobody needs it any more
    again = InOrder()
    Schedule(jobs).run(again)
    assert again.ran == ["d"]


def test_the_first_target_comes_first_as_far_as_needs_allow(tmp_path: Path) -> None:
    roots = [FileJob(tmp_path / f"root{i}.json") for i in range(2)]
    targets = [FileJob(tmp_path / f"{root.name}-{part}.json", needs=(root,)) for root in roots for part in "ab"]
    executor = InOrder()
    Schedule(targets).run(executor)
    assert executor.ran == ["root0", "root0-a", "root0-b", "root1", "root1-a", "root1-b"]
    targets[2].path.unlink()
    later = FileJob(tmp_path / "later.json", needs=(targets[2], FileJob(tmp_path / "early.json")))
    again = InOrder()
    Schedule([later, *targets]).run(again)
    assert again.ran == ["root1-a", "early", "later"]


def test_a_failure_is_told_and_stops_only_what_needs_it(tmp_path: Path) -> None:
    jobs = graph(tmp_path, root="fail")
    schedule = Schedule(jobs)
    schedule.run(InOrder())
    assert [job.name for job in schedule.failed] == ["root"]
    (message,) = schedule.failed.values()
    assert "RuntimeError: as it was told" in message and "root.log" in message
    assert "as it was told" in (tmp_path / "root.log").read_text()
    assert [job.done for job in jobs] == [False, False, True, True]


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced_and_its_job_run_again(tmp_path: Path) -> None:
    expected, jobs = graph(tmp_path / "expected"), graph(tmp_path / "got", c="die")
    Schedule(expected).run(InOrder())
    schedule = Schedule(jobs)
    with LocalExecutor(2) as executor:
        schedule.run(executor)
    assert not schedule.failed
    assert [job.path.read_text() for job in jobs] == [job.path.read_text() for job in expected]
    assert jobs[2].runs == 2


@dataclass(frozen=True)
class Deadly(FileJob):
    """Kills every process that runs it."""

    def run(self) -> None:
        with self._started.open("a") as file:
            file.write("\n")
        os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.slow
def test_a_job_that_kills_every_worker_is_given_up(tmp_path: Path) -> None:
    deadly = Deadly(tmp_path / "deadly.json")
    schedule = Schedule([deadly])
    with LocalExecutor(1) as executor:
        schedule.run(executor)
    assert "its worker died" in schedule.failed[deadly]
    assert deadly.runs == ATTEMPTS


@pytest.mark.slow
def test_killed_it_resumes_where_it_was(tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from file_jobs import FileJob; "
        "from er_il.experiments.schedule import Schedule\n"
        "from er_il.support.workers import LocalExecutor\n"
        "if __name__ == '__main__':\n"
        "    with LocalExecutor(1) as executor:\n"
        "        Schedule([FileJob(Path(sys.argv[1]) / f'{i}.json', seed=i, sleep=60 * (i == 2)) for i in range(4)])"
        ".run(executor)\n"
    )
    (tmp_path / "script.py").write_text(script)
    environment = os.environ | {"PYTHONPATH": str(TESTS)}
    driver = subprocess.Popen([sys.executable, str(tmp_path / "script.py"), str(tmp_path)], env=environment)
    started = tmp_path / "2.started"
    deadline = time.monotonic() + 120
    while not started.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    worker = int(started.read_text().split()[0])
    driver.kill()
    driver.wait()
    while Path(f"/proc/{worker}").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not Path(f"/proc/{worker}").exists()  # or it would write beside its successor
    jobs = [FileJob(tmp_path / f"{i}.json", seed=i) for i in range(4)]
    assert [job.done for job in jobs] == [True, True, False, False]
    Schedule(jobs).run(InOrder())
    assert [job.runs for job in jobs] == [1, 1, 2, 1]
