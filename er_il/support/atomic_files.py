"""Files that are whole or absent: written under another name, and given their own at the end."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` write a file under another name of the same ending, and give it its own once it is whole.

    Where it fails, as on a full disk, nothing is left of it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_stem(f"{path.stem}.partial")
    try:
        write(partial)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    partial.rename(path)


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a report, for people to read too."""
    write_atomically(path, lambda partial: partial.write_text(json.dumps(data, indent=2) + "\n"))


def write_arrays(path: Path, arrays: Mapping[str, Any]) -> None:
    """Write arrays as a compressed ``.npz``."""

    def write(partial: Path) -> None:
        with partial.open("wb") as file:  # given a path, NumPy would add an ending where there is none
            np.savez_compressed(file, allow_pickle=False, **arrays)

    write_atomically(path, write)
