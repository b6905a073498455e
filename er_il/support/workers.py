"""Worker processes that end with their parent, however it ends, and compute with one thread each."""

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from typing import Any

from loky import ProcessPoolExecutor, cpu_count, get_reusable_executor

# With two threads on two cores, a step of a small policy takes ten times as long as with one. Read by NumPy and
# PyTorch when they are loaded: for processes that are about to start.
ONE_THREAD = {"OMP_NUM_THREADS": "1"}
# loky would replace a worker that has grown by 300 MB as a leaking one; importing LeRobot takes more.
_ENVIRONMENT = ONE_THREAD | {"LOKY_MAX_MEMORY_LEAK_SIZE": "1e12"}

_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None  # loaded here: little is safe between fork and exec
_PR_SET_PDEATHSIG = 1
_POLL = 0.5  # [s] between looks at the parent


def cores() -> int:
    """Number of cores that this process may use."""
    return cpu_count()


@contextmanager
def worker_pool(workers: int, initializer: Callable[..., None], *arguments: object) -> Iterator[Executor]:
    """Yield a pool of fresh processes, each prepared by ``initializer(*arguments)``; they are killed at the end.

    loky starts them without a fork, which neither OpenGL contexts nor the threads of PyTorch survive.
    """
    pool = ProcessPoolExecutor(workers, **_start_with(initializer, *arguments))
    try:
        yield pool
    finally:
        pool.shutdown(kill_workers=True)


class LocalExecutor:
    """Runs functions in processes of this machine; those that died are replaced.

    Use it in a ``with`` statement. What ran beside the process that died fails too, with
    :class:`concurrent.futures.BrokenExecutor`, and may be submitted again.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def __enter__(self) -> "LocalExecutor":
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool().shutdown(kill_workers=True)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]":
        """Run a function in one of the processes."""
        return self._pool().submit(function, *arguments)

    def _pool(self) -> Any:
        return get_reusable_executor(self.workers, **_start_with())  # a new one if the last is broken


def run_jobs[T](
    jobs: Sequence[tuple[Callable[..., T], *tuple[Any, ...]]], workers: int, advance: Callable[[int, int], object]
) -> list[T]:
    """Run jobs, each a function and its arguments, and return their results in order.

    Args:
        jobs: Functions of modules, and arguments that can be pickled.
        workers: Number of worker processes; with one, no process is started.
        advance: Called with the number of jobs done, and their total.
    """
    done: list[T] = []

    def collect(results: Iterable[T]) -> list[T]:
        for result in results:
            done.append(result)
            advance(len(done), len(jobs))
        return done

    if workers == 1:
        return collect(function(*arguments) for function, *arguments in jobs)
    with worker_pool(workers, _nothing) as pool:
        running = [pool.submit(*job) for job in jobs]
        return collect(job.result() for job in running)


def end_with_parent() -> None:
    """Let this process, of a program that knows nothing of us, be killed when its parent dies (on Linux)."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _nothing() -> None:
    """Prepare nothing: the jobs bring all they need."""


def _start_with(initializer: Callable[..., None] = _nothing, *arguments: object) -> dict[str, Any]:
    prepared = (os.getpid(), initializer, arguments)
    return {"initializer": _start, "initargs": prepared, "env": _ENVIRONMENT, "timeout": None}


def _start(parent: int, initializer: Callable[..., None], arguments: tuple[object, ...]) -> None:
    # loky's workers outlive a parent that is killed: they finish their job, and wait for others for ever.
    threading.Thread(target=_end_without, args=(parent,), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    initializer(*arguments)


def _end_without(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_POLL)
    os._exit(1)
