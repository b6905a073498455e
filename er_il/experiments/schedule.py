"""Jobs that need one another's results, run in order on an executor.

A job's result is a file. What is there is not made again, so an interrupted schedule goes on where it was.
"""

import traceback
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

from er_il.support.cost import Cost
from er_il.support.errors import ErIlError
from er_il.support.provenance import git_sha

POLL = 0.5  # [s] between looks at what runs
ATTEMPTS = 3  # of a job whose worker died under it


@dataclass(frozen=True)
class Job(ABC):
    """Work whose result is a file or folder. Jobs travel to other processes: small, hashable, compared by value."""

    path: Path  # of the result
    name: str  # what it does, for people; no two jobs of a schedule share it
    needs: "tuple[Job, ...]"  # jobs whose results it reads
    size: int  # amount of its work in units of its stage, such as training steps

    stage: ClassVar[str]  # kind of work, such as "Train"; the jobs of a stage share a progress bar
    progress = 0  # how much of it is done so far, while it runs

    @property
    def log(self) -> Path:
        """Where it says what went wrong."""
        return self.path.with_suffix(".log")

    @property
    def done(self) -> bool:
        """True if its result is there."""
        return self.path.exists()

    @abstractmethod
    def run(self) -> None:
        """Make the result."""


def notes(cost: Cost) -> dict[str, Any]:
    """What results say of how they came about, as JSON."""
    return {"cost": asdict(cost), "git": git_sha()}


class Executor(Protocol):
    """Runs functions elsewhere, one on each of its workers."""

    @property
    def workers(self) -> int: ...

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]": ...


class Schedule:
    """Targets and the jobs that they need, as far as their results are not there yet: a job after its needs."""

    def __init__(self, targets: Iterable[Job]) -> None:
        self.jobs: dict[Job, None] = {}  # in the order in which they start, as far as needs and workers allow
        self.running: set[Job] = set()
        self.done: set[Job] = set()
        self.failed: dict[Job, str] = {}
        self._deaths: Counter[Job] = Counter()
        for target in targets:
            self._add(target)

    def _add(self, job: Job) -> None:
        if job in self.jobs:
            return
        if job.done:
            self.done.add(job)
        else:
            for need in job.needs:
                self._add(need)
        self.jobs[job] = None

    def progress(self, job: Job) -> int:
        """How much of a job's size is done."""
        return job.size if job in self.done else job.progress if job in self.running else 0

    def run(self, executor: Executor, watch: Callable[[], None] = lambda: None) -> None:
        """Run all jobs; one that fails, fails alone.

        Args:
            executor: Where they run.
            watch: Called when something has changed, and every half second.
        """
        futures: dict[Future[str], Job] = {}
        while True:
            while len(futures) < executor.workers and (job := self._next()):
                self.running.add(job)
                futures[executor.submit(perform, job)] = job
            watch()
            if not futures:
                return
            for future in wait(futures, timeout=POLL, return_when=FIRST_COMPLETED).done:
                self._finish(futures.pop(future), future)

    def _next(self) -> Job | None:
        """The first job that may start."""
        begun = self.done | self.running | self.failed.keys()
        return next((job for job in self.jobs if job not in begun and self.done.issuperset(job.needs)), None)

    def _finish(self, job: Job, future: "Future[str]") -> None:
        self.running.remove(job)
        try:
            message = future.result()
        except BrokenExecutor as error:
            self._deaths[job] += 1
            if self._deaths[job] < ATTEMPTS:
                return
            message = f"its worker died {ATTEMPTS} times ({error})"
        except Exception as error:  # the executor gave it up
            message = f"{type(error).__name__}: {error}"
        if message:
            self.failed[job] = f"{job.name}: {message}"
        else:
            self.done.add(job)


def perform(job: Job) -> str:
    """Run a job where it was sent.

    Returns:
        What went wrong in one line, which the job's log explains; "" if nothing did. As a value, for not every
        exception survives the way back from another process.
    """
    try:
        if not job.done:
            job.run()
    except Exception as error:
        job.log.parent.mkdir(parents=True, exist_ok=True)
        with job.log.open("a") as file:
            traceback.print_exc(file=file)
        what = str(error) if isinstance(error, ErIlError) else f"{type(error).__name__}: {error}"
        return f"{what} (log: {job.log})"
    return ""
