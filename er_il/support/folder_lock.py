"""A folder in which one command at a time works."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from er_il.support.errors import ErIlError

LOCK = ".lock"


@contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Work in a folder alone: what resumes from its files would be done twice, and half-written, by two.

    The operating system ends the lock with the process, however that ends.

    Raises:
        ErIlError: another process works in it.
    """
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise ErIlError(f"Another command works in {folder}; wait for it, end it, or choose another --out.") from None
    try:
        yield
    finally:
        lock.release()
