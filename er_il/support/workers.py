"""Worker processes that end with their parent, however it ends."""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process
from typing import Any

_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None  # loaded here: little is safe between fork and exec
_PR_SET_PDEATHSIG = 1


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def worker_pool(workers: int, initializer: Callable[..., None], *arguments: object) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of fresh processes, each prepared by ``initializer(*arguments)``.

    On an exception, jobs that have not started are dropped. Workers are spawned, not forked: OpenGL
    contexts and the threads of PyTorch do not survive a fork.
    """
    pool = _pool(workers, initializer, *arguments)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


class LocalExecutor:
    """Runs functions in processes of this machine, one thread each; a process that died is replaced.

    Use it in a ``with`` statement. What ran beside the process that died fails too, with
    :class:`BrokenProcessPool`, and may be submitted again.
    """

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def __enter__(self) -> "LocalExecutor":
        self._pool = _pool(self.workers, one_thread)
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]":
        """Run a function in one of the processes."""
        try:
            return self._pool.submit(function, *arguments)
        except BrokenProcessPool:
            self._pool.shutdown()
            self._pool = _pool(self.workers, one_thread)
            return self._pool.submit(function, *arguments)


def one_thread() -> None:
    """Let this process compute with one thread: more than cores make small matrices ten times slower."""
    os.environ["OMP_NUM_THREADS"] = "1"


def end_with_parent() -> None:
    """Let this process, of a program that knows nothing of us, be killed when its parent dies (on Linux)."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _pool(workers: int, initializer: Callable[..., None], *arguments: object) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, get_context("spawn"), _start, (initializer, arguments))


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


def _nothing() -> None:
    """Prepare nothing: the jobs bring all they need."""


def _start(initializer: Callable[..., None], arguments: tuple[object, ...]) -> None:
    # A parent that is killed cannot tell its workers; without this they would wait for jobs for ever.
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    initializer(*arguments)


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
