"""Worker processes that end with their parent, however it ends."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection, get_context, parent_process


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def worker_pool(workers: int, initializer: Callable[..., None], *arguments: object) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of fresh processes, each prepared by ``initializer(*arguments)``.

    On an exception, jobs that have not started are dropped. Workers are spawned, not forked: OpenGL
    contexts and the threads of PyTorch do not survive a fork.
    """
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _start, (initializer, arguments))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


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
