"""Files and folders that are complete or absent: written under another name, then renamed."""

import errno
import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from er_il.support.errors import ErIlError
from er_il.support.folder_lock import LOCK, folder_lock

PARTIAL = ".partial"  # in the name of every file and folder that is not complete


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` write a file under another name of the same suffix, one that no other process has, and rename it.

    If it fails, as on a full disk, the unfinished file is removed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_stem(f"{path.stem}{PARTIAL}-{uuid4().hex[:8]}")
    with _naming(path):
        try:
            write(partial)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        partial.rename(path)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write indented JSON."""
    write_atomically(path, lambda partial: partial.write_text(json.dumps(data, indent=2) + "\n"))


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays as a compressed ``.npz``."""

    def write(partial: Path) -> None:
        with partial.open("wb") as file:  # given a path, NumPy would add an ending where there is none
            np.savez_compressed(file, allow_pickle=False, **arrays)

    write_atomically(path, write)


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Yield the path of a folder to create, which is renamed to the target after the block, or removed if it fails.

    It lies in ``<target>.partial``, which is locked: one process at a time writes a target. What a killed process left
    there is removed.

    Raises:
        FileExistsError: the target exists.
        ErIlError: another process is writing it.
    """
    check_absent(target)
    with work_folder(target) as work:
        check_absent(target)  # another process may have finished it in between
        _clear(work)
        try:
            with _naming(target):
                yield work / target.name
            (work / target.name).rename(target)
        finally:
            _clear(work)


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Add the path to errors of the system that name none, as those of a full disk."""
    try:
        yield
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(path)
        raise


def check_writable(*paths: Path | None) -> None:
    """Raise an OSError if files or folders could not be written, before the work that they are for.

    Args:
        paths: Files or folders to write, which need not exist; None is nothing to write.
    """
    for path in filter(None, paths):
        there = next(each for each in (path, *path.absolute().parents) if each.exists())
        if there != path and not there.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(there))
        if not os.access(there, os.W_OK):
            raise PermissionError(errno.EACCES, "It cannot be written", str(path))


def check_outside(target: Path, source: Path) -> None:
    """Raise an ErIlError if a target lies in the folder that it is made from."""
    if target.resolve().is_relative_to(source.resolve()):
        raise ErIlError(f"{target} lies in {source}, which it is made from. Choose another --out.")


def check_absent(target: Path) -> None:
    """Raise a FileExistsError if there is something where a folder is to be written."""
    if target.exists():
        raise FileExistsError(errno.EEXIST, "The target exists already", str(target))


@contextmanager
def work_folder(target: Path) -> Iterator[Path]:
    """Yield ``<target>.partial``, a folder for one process at a time; removed at the end unless it holds something.

    Raises:
        ErIlError: another process works in it.
    """
    work = target.with_name(target.name + PARTIAL)
    work.mkdir(parents=True, exist_ok=True)
    with folder_lock(work):
        try:
            yield work
        finally:
            if [path.name for path in work.iterdir()] == [LOCK]:
                shutil.rmtree(work)


def _clear(work: Path) -> None:
    for path in work.iterdir():
        if path.is_dir():
            shutil.rmtree(path)
        elif path.name != LOCK:
            path.unlink()
