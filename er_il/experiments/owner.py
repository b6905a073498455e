"""Whose a folder of an experiment is: a file says how what lies there came about."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from er_il.support.atomic_files import PARTIAL, write_json
from er_il.support.errors import ErIlError
from er_il.support.folder_lock import LOCK, folder_lock
from er_il.support.json_files import read_json

OWNER = "benchmark.json"


@contextmanager
def claimed(folder: Path, check: Callable[[], Mapping[str, Any]]) -> Iterator[None]:
    """Work in a folder alone.

    Args:
        folder: The folder.
        check: Refuses a folder that does not suit by an ErIlError; returns what the folder is to say.

    Raises:
        ErIlError: another command works in it, or it is refused.
    """
    check()  # a folder of something else is left as it is, without a lock
    folder.mkdir(parents=True, exist_ok=True)
    with folder_lock(folder):
        write_json(folder / OWNER, check())
        yield


def owner_of(folder: Path) -> dict[str, Any] | None:
    """What a folder says; None if it is new.

    Raises:
        ErIlError: it holds something else than an experiment, or what it says is damaged.
    """
    found = {path.name for path in folder.iterdir()} if folder.exists() else set()
    if OWNER in found:
        return read_json(folder / OWNER, ErIlError)
    if {name for name in found - {LOCK} if PARTIAL not in name}:  # a kill may come before the owner is said
        raise ErIlError(f"{folder} holds something else than an experiment; choose another --out.")
    return None
