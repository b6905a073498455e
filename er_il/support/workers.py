"""Worker processes that end with their parent, however it ends, and compute with one thread each."""

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from functools import partial
from typing import Any, Concatenate, Self

from loky import ProcessPoolExecutor, cpu_count

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


class LocalExecutor(Executor):
    """Runs functions in fresh processes of this machine in a ``with`` statement; an exception kills what still runs.

    Processes that died are replaced. What ran beside them fails too, with :class:`concurrent.futures.BrokenExecutor`,
    and may be submitted again. loky starts processes without a fork, which OpenGL and PyTorch do not survive.

    Args:
        workers: Number of processes.
        make: Makes the state that a process keeps for :class:`StatefulWorkers`.
    """

    def __init__(self, workers: int, make: Callable[[], Any] | None = None) -> None:
        self.workers = workers
        self._prepared = (os.getpid(), make)
        self._pool = self._new_pool()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        try:
            return self._pool.submit(fn, *args, **kwargs)
        except BrokenExecutor:
            self._pool = self._new_pool()
            return self._pool.submit(fn, *args, **kwargs)

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:  # pyrefly: ignore[bad-override]
        self._pool.shutdown(kill_workers=kind is not None)

    def _new_pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self.workers, initializer=_start, initargs=self._prepared, env=_ENVIRONMENT)


class StatefulWorkers[S]:
    """Workers in a ``with`` statement that each make a state once, such as a world, and run functions of it.

    With one worker no process is started: jobs run in this one when their results are asked for.

    Args:
        workers: Number of workers.
        make: Makes the state; a function of a module, or a partial of one.
    """

    def __init__(self, workers: int, make: Callable[[], S]) -> None:
        self._make = make
        self._executor = LocalExecutor(workers, make) if workers > 1 else None
        self._own: S | None = None

    def submit[**P, T](
        self, function: Callable[Concatenate[S, P], T], /, *args: P.args, **kwargs: P.kwargs
    ) -> Callable[[], T]:
        """Let a worker run a function of its state and more arguments; returns what waits for the result."""
        if self._executor is not None:
            return self._executor.submit(_with_state, function, *args, **kwargs).result

        def run() -> T:
            self._own = self._make() if self._own is None else self._own
            return function(self._own, *args, **kwargs)

        return run

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: Any) -> None:
        if self._executor is not None:
            self._executor.__exit__(*exception)


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
    with LocalExecutor(workers) as executor:
        calls = [partial(*job) if workers == 1 else executor.submit(*job).result for job in jobs]
        for call in calls:
            done.append(call())
            advance(len(done), len(jobs))
    return done


def end_with_parent() -> None:
    """Let this process, of a program that knows nothing of us, be killed when its parent dies (on Linux).

    Ctrl-C, which reaches the whole group, it leaves to the parent.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


_state: Any = None  # of a worker process


def _with_state(function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    return function(_state, *args, **kwargs)


def _start(parent: int, make: Callable[[], Any] | None) -> None:
    # loky's workers outlive a parent that is killed: they finish their job, and wait for others for ever.
    threading.Thread(target=_end_without, args=(parent,), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    if make is not None:
        global _state
        _state = make()


def _end_without(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_POLL)
    os._exit(1)
