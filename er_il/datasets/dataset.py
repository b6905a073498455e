"""A LeRobot v3 dataset on disk: metadata, columns and episodes, read without LeRobot, whose import takes seconds."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, STATE, Feature, dimension_names
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION, SPEC
from er_il.support.atomic_files import PARTIAL
from er_il.support.errors import DatasetError

Floats = NDArray[np.float32]

INFO = Path("meta/info.json")
DATA, EPISODES = "data", "meta/episodes"  # folders of tables: a row a frame, a row an episode
EPISODE = "episode_index"
VERSION = "v3."  # of LeRobot's format


@dataclass(frozen=True, eq=False)
class Dataset:
    """A LeRobot v3 dataset of N frames in a folder. Nothing is read before it is asked for.

    Every attribute but the root raises a DatasetError where the folder holds no such dataset.
    """

    root: Path

    @cached_property
    def info(self) -> dict[str, Any]:
        """Contents of ``meta/info.json``."""
        kind = "a LeRobot v3 dataset"
        info = read_metadata(self.root, INFO, kind)
        try:
            version, frames, _ = str(info["codebase_version"]), info["total_frames"], info["fps"]
            features = {name: each | {"shape": tuple(each["shape"])} for name, each in info["features"].items()}
        except (AttributeError, KeyError, TypeError) as error:
            raise DatasetError(f"{self.root} is not {kind}: its {INFO} is incomplete ({error}).") from error
        if not version.startswith(VERSION):
            raise DatasetError(
                f"{self.root} is a LeRobot dataset of version {version}, not v3.0. Convert it first: "
                "python -m lerobot.scripts.convert_dataset_v21_to_v30."
            )
        if not frames or ACTION not in features:
            raise DatasetError(f"{self.root} holds no actions.")
        return info | {"features": features}

    @property
    def features(self) -> dict[str, Feature]:
        """Description of each column."""
        return self.info["features"]

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.info["total_frames"]

    @property
    def fps(self) -> float:
        """Control steps a second [Hz]."""
        return self.info["fps"]

    @property
    def specified(self) -> bool:
        """True if the dataset says what its actions mean."""
        return SPEC in (self.features[ACTION].get("info") or {})

    @property
    def spec(self) -> dict[str, Any]:
        """Specification of the actions (:meth:`er_il.spaces.layout.Layout.spec`).

        Raises:
            DatasetError: there is none.
        """
        if not self.specified:
            raise DatasetError(
                "The dataset does not say what its actions mean. Write it again so that it does, as it is or in "
                "another space: er-il encode DATASET --to joint --arm panda --out OUT."
            )
        return self.features[ACTION]["info"][SPEC]

    @cached_property
    def layout(self) -> Layout:
        """Layout of the actions.

        Raises:
            DatasetError: the dataset does not say what its actions mean.
            SpecError: the specification is damaged, or of another version.
        """
        return Layout.from_spec(self.spec)

    def names(self, column: str) -> tuple[str, ...]:
        """Names of a column's dimensions; empty if there is no such column."""
        return dimension_names(self.features[column]) if column in self.features else ()

    def column(self, name: str) -> NDArray[Any]:
        """Read a numeric column (N, dim), in the order of the data's files."""
        return np.concatenate([column_of(read_table(path, name), name) for path in self.data_files])

    def vectors(self, column: str) -> Floats:
        """Read a column of vectors (N, dim)."""
        return self.column(column).astype(np.float32)

    @cached_property
    def episodes(self) -> dict[int, slice]:
        """Rows of each episode, by its number."""
        numbers = self.column(EPISODE)[:, 0]
        return {int(numbers[rows.start]): rows for rows in episode_slices(numbers)}

    def rows(self, table: str, columns: Sequence[str], episode: int) -> list[dict[str, Any]]:
        """Read columns of :data:`DATA` or :data:`EPISODES`, in the rows of an episode."""
        import pyarrow.dataset as pads  # and with it pandas: half a second that metadata do without

        rows = pads.dataset(self.root / table, format="parquet")
        return rows.to_table(columns=list(columns), filter=pads.field(EPISODE) == episode).to_pylist()

    @property
    def data_files(self) -> list[Path]:
        """Files that hold the frames, in order."""
        files = parquet_files(self.root / DATA)
        if not files:
            raise DatasetError(f"{self.root} holds no readable data.")
        return files

    def joints_column(self, layout: Layout) -> str | None:
        """Name of the column that holds the joint vectors of a layout as they were recorded, if there is one."""
        for column in (LEADER_JOINTS, SOURCE_ACTION, ACTION):
            encoded = column == ACTION and self.specified and self.spec["space"] != JOINT
            if self.names(column) == layout.names and not encoded:
                return column
        return None

    def measured_joints(self, layout: Layout) -> NDArray[np.float64] | None:
        """Measured joint vectors (N, D), NaN in dimensions that belong to no arm; None unless all arms are measured."""
        names = self.names(STATE)
        if not all(part.motors.state and set(part.motors.state) <= set(names) for part in layout.parts):
            return None
        state = self.vectors(STATE)
        measured = np.full((len(state), len(layout.names)), np.nan)
        for part in layout.parts:
            measured[:, layout.indices(part)] = state[:, [names.index(name) for name in part.motors.state]]
        return measured


def datasets_in(folder: Path) -> list[Path]:
    """Datasets that lie in a folder, in alphabetical order, without those that are not complete."""
    found = (path.parents[1] for path in folder.glob(f"*/{INFO}"))
    return sorted(path for path in found if PARTIAL not in path.name)


def read_metadata(root: Path, name: Path, kind: str) -> dict[str, Any]:
    """Read a JSON file of a dataset.

    Args:
        root: The dataset's folder.
        name: The file's path in it.
        kind: What kind of dataset has such a file.

    Raises:
        DatasetError: it is missing or no JSON.
    """
    try:
        return json.loads((root / name).read_text())
    except (FileNotFoundError, NotADirectoryError) as error:
        raise DatasetError(f"{root} is not {kind}: it has no {name}.") from error
    except ValueError as error:
        raise DatasetError(f"{root} is not {kind}: its {name} is damaged, not valid JSON.") from error


def read_table(path: Path, *columns: str) -> pa.Table:
    """Read columns of a parquet file, all by default.

    Raises:
        DatasetError: the file is incomplete, as LeRobot leaves it when a recording is killed, or lacks a column.
    """
    try:
        return pq.read_table(path, columns=list(columns) or None)
    except pa.ArrowInvalid as error:
        raise DatasetError(f"{path} is damaged, as by a recording that was killed: {error}") from error


def column_of(table: pa.Table, name: str) -> NDArray[Any]:
    """Values (rows, dim) of a numeric column of a table."""
    if name not in table.column_names:
        raise DatasetError(f"The data have no column {name}, though the dataset's metadata name it.")
    column = table.column(name).combine_chunks()
    flat = column.flatten() if pa.types.is_nested(column.type) else column
    return flat.to_numpy(zero_copy_only=False).reshape(len(table), -1)


def episode_slices(numbers: NDArray[np.int64]) -> list[slice]:
    """Rows of each episode, from the episode (N,) of each row."""
    starts = np.flatnonzero(np.diff(numbers, prepend=-1)).tolist()
    return [slice(start, stop) for start, stop in zip(starts, [*starts[1:], len(numbers)], strict=True)]


def parquet_files(folder: Path) -> list[Path]:
    """Parquet files of a table's folder, in order."""
    return sorted(folder.glob("*/*.parquet"))
