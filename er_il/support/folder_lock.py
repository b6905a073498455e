"""A folder in which one command at a time works."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from er_il.support.errors import ErIlError

LOCK = ".lock"


@contextmanager
def folder_lock(folder: Path, marker: str) -> Iterator[None]:
    """Work in a folder alone: what resumes from its files would be done twice, and half-written, by two.

    The operating system ends the lock with the process, however that ends.

    Args:
        folder: Where to work; made if it does not exist.
        marker: A file that tells our folders from others: one that holds anything must hold it, too.

    Raises:
        ErIlError: another process works in it, or it holds something else; it is left as it is then.
    """
    found = {path.name for path in folder.iterdir()} if folder.exists() else set()
    if found - {LOCK} and marker not in found:
        raise ErIlError(f"{folder} holds something else than an experiment of er_il; choose another --out.")
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise ErIlError(f"Another command works in {folder}; wait for it, end it, or choose another --out.") from None
    try:
        yield
    finally:
        lock.release()
