"""Parquet tables of a dataset, read without LeRobot."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from er_il.support.errors import DatasetError


def read_table(path: Path, *columns: str) -> pa.Table:
    """Read columns of a parquet file, all by default; those that it lacks are left out.

    Raises:
        DatasetError: the file is incomplete, as LeRobot leaves it when a recording is killed, or otherwise damaged.
    """
    # With a row group an episode, several times as fast as pq.read_table, which reads folders of files too.
    with reading(path), pq.ParquetFile(path) as file:
        return file.read(columns=list(columns) or None)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Raise a DatasetError where a parquet file is missing or damaged."""
    try:
        yield
    except IsADirectoryError as error:
        raise DatasetError(f"{path} is a folder, not a file.") from error
    except FileNotFoundError as error:
        raise DatasetError(f"There is no {path}.") from error
    except (pa.ArrowException, OSError) as error:  # Arrow has OSErrors of its own for what it cannot decompress
        if isinstance(error, OSError) and error.errno is not None:
            raise
        said = " ".join(str(error).split())
        raise DatasetError(f"{path} is damaged, as by a recording that was killed: {said}") from error


def column_of(table: pa.Table, name: str, path: Path) -> NDArray[Any]:
    """Values (rows, dim) of a numeric column of a table, which was read from a file.

    Raises:
        DatasetError: there is no such column, or it holds something else than as many numbers in each row.
    """
    if name not in table.column_names:
        raise DatasetError(f"{path} has no column {name}, though the dataset's metadata name it.")
    column = table.column(name).combine_chunks()
    listed = pa.types.is_list(column.type) or pa.types.is_fixed_size_list(column.type)
    flat = column.flatten() if listed else column
    numeric = any(is_kind(flat.type) for is_kind in (pa.types.is_integer, pa.types.is_floating, pa.types.is_boolean))
    lengths = pc.min_max(pc.list_value_length(column)).as_py() if listed else {"min": 1, "max": 1}  # pyrefly: ignore[missing-attribute]
    if not numeric or column.null_count or flat.null_count or lengths["min"] != lengths["max"]:
        raise DatasetError(f"{path} is damaged: not every row of its column {name} holds as many numbers.")
    return flat.to_numpy(zero_copy_only=False).reshape(len(table), -1 if len(table) else 1)


def episode_slices(numbers: NDArray[np.int64]) -> list[slice]:
    """Rows of each episode, from the episode (N,) of each row."""
    starts = np.flatnonzero(np.diff(numbers, prepend=-1)).tolist()
    return [slice(start, stop) for start, stop in zip(starts, [*starts[1:], len(numbers)], strict=True)]


def parquet_files(folder: Path) -> list[Path]:
    """Parquet files of a table's folder, in order."""
    return sorted(folder.glob("*/*.parquet"))
