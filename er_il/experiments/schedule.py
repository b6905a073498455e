"""Jobs that need one another's results: which may run now, what became of the others.

A job's result is a file. What is there is not made again, so an interrupted schedule goes on where it was.
"""

import time
import traceback
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from pathlib import Path
from typing import Any, Protocol

from er_il.support.errors import ErIlError

POLL = 0.5  # [s] between looks at what runs
ATTEMPTS = 3  # of a job whose worker died under it


class Job(Protocol):
    """Work with a result on disk. Jobs travel to other processes: small, hashable, and equal if their work is."""

    @property
    def name(self) -> str:
        """What it does, for people; no two jobs of a schedule share it."""
        ...

    @property
    def needs(self) -> "tuple[Job, ...]":
        """Jobs whose results it reads."""
        ...

    @property
    def log(self) -> Path:
        """Where it says what went wrong."""
        ...

    @property
    def done(self) -> bool:
        """Whether its result is there."""
        ...

    def run(self) -> None:
        """Make the result."""
        ...


class FileResult:
    """What jobs share whose result is one file."""

    path: Path  # of the result

    @property
    def log(self) -> Path:
        """What went wrong, if something did."""
        return self.path.with_suffix(".log")

    @property
    def done(self) -> bool:
        """Whether the result is there."""
        return self.path.exists()


class Executor(Protocol):
    """Where functions run."""

    @property
    def workers(self) -> int:
        """How many run at once."""
        ...

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]":
        """Run a function elsewhere."""
        ...


class Schedule:
    """The jobs that targets need, as far as their results are not there yet.

    A worker that comes free takes a target, so that results come early. Only when no more jobs are left
    that others wait for than there are workers, these come first: then targets fill up the end, and no
    worker idles beside the last long job.
    """

    def __init__(self, targets: Iterable[Job]) -> None:
        self.targets = tuple(dict.fromkeys(targets))
        self.waiting: list[Job] = []
        self.running: dict[Job, float] = {}  # to the time when it started [s], of time.monotonic
        self.done: set[Job] = set()
        self.failed: dict[Job, str] = {}
        self._deaths: dict[Job, int] = {}
        self._seen: set[Job] = set()
        self._needed: set[Job] = set()  # by other jobs
        for target in self.targets:
            self._add(target)

    def _add(self, job: Job) -> None:
        if job in self._seen:
            return
        self._seen.add(job)
        if job.done:
            self.done.add(job)
            return
        for need in job.needs:
            self._needed.add(need)
            self._add(need)
        self.waiting.append(job)

    def run(self, executor: Executor, watch: Callable[[], None] = lambda: None) -> None:
        """Run all jobs; one that fails, fails alone.

        Args:
            executor: Where they run.
            watch: Called when something has changed, and every half second.
        """
        futures: dict[Future[str], Job] = {}
        while True:
            while len(futures) < executor.workers and (job := self._next(executor.workers)):
                self.waiting.remove(job)
                self.running[job] = time.monotonic()
                futures[executor.submit(perform, job)] = job
            watch()
            if not futures:
                return
            for future in wait(futures, timeout=POLL, return_when=FIRST_COMPLETED).done:
                self._finish(futures.pop(future), future)

    @property
    def skipped(self) -> list[Job]:
        """Targets that miss the result of a job that failed."""
        return [job for job in self.targets if job in self.waiting]

    def _next(self, workers: int) -> Job | None:
        ready = [job for job in self.waiting if all(need in self.done for need in job.needs)]
        awaited = [job for job in self.waiting if job in self._needed]
        first = len(awaited) <= workers
        return min(ready, key=lambda job: (job in self._needed) != first, default=None)

    def _finish(self, job: Job, future: "Future[str]") -> None:
        del self.running[job]
        try:
            message = future.result()
        except BrokenExecutor as error:
            self._deaths[job] = self._deaths.get(job, 0) + 1
            if self._deaths[job] < ATTEMPTS:
                self.waiting.insert(0, job)
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
    if job.done:
        return ""
    try:
        job.run()
    except Exception as error:
        job.log.parent.mkdir(parents=True, exist_ok=True)
        with job.log.open("a") as file:
            traceback.print_exc(file=file)
        what = str(error) if isinstance(error, ErIlError) else f"{type(error).__name__}: {error}"
        return f"{what} (log: {job.log})"
    return ""
