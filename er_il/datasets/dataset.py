"""A LeRobot v3 dataset on disk: metadata, columns and episodes, read without LeRobot, whose import takes seconds."""

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from er_il.datasets.history import recorded_spec
from er_il.datasets.metadata import DatasetInfo
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, SOURCE_JOINTS, STATE, Feature, dimension_names
from er_il.datasets.tables import column_of, episode_slices, parquet_files, read_table, reading
from er_il.spaces.chunk import commands_of
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION, SPEC
from er_il.support.atomic_files import PARTIAL
from er_il.support.declaration import check_values
from er_il.support.errors import DatasetError, SpecError
from er_il.support.json_files import read_json

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
        version = str(info.get("codebase_version"))
        if "codebase_version" in info and not version.startswith(VERSION):
            raise DatasetError(
                f"{self.root} is a LeRobot dataset of version {version}, not v3.0. {conversion(version, self.root)}"
            )
        check_values(DatasetInfo, info, self.root / INFO, DatasetError)
        features = {name: each | {"shape": tuple(each["shape"])} for name, each in info["features"].items()}
        if not info["total_frames"] or not info["total_episodes"]:
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
        return self._said is not None

    @cached_property
    def _said(self) -> Any:
        """What the feature says; if nothing, the record, as of joints that were restored to what they had been."""
        if ACTION not in self.features:
            return None
        info = self.features[ACTION].get("info") or {}
        return info[SPEC] if SPEC in info else recorded_spec(self.root)

    @property
    def spec(self) -> dict[str, Any]:
        """Specification of the actions (:meth:`er_il.spaces.layout.Layout.spec`).

        Raises:
            DatasetError: there is none.
            SpecError: it is damaged.
        """
        if ACTION not in self.features:
            raise DatasetError(f"{self.root} holds no actions.")
        if not self.specified:
            raise DatasetError(
                "The dataset does not say what its actions mean. Write it again so that it does, as it is or in "
                "another space: er-il encode DATASET --to joint --arm panda --out OUT."
            )
        spec = self._said
        if not isinstance(spec, dict) or not isinstance(spec.get("space"), str):
            raise SpecError(f"{self.root / INFO} is damaged: its action spec names no action space.")
        return spec

    @cached_property
    def layout(self) -> Layout:
        """Layout of the actions.

        Raises:
            DatasetError: the dataset does not say what its actions mean.
            SpecError: the specification is damaged, or of another version.
        """
        layout = Layout.from_spec(self.spec)
        if layout.encoded_names != self.names(ACTION):
            raise SpecError(
                f"{self.root / INFO} says that the actions are {', '.join(layout.encoded_names)}, but names their "
                f"dimensions {', '.join(self.names(ACTION))}."
            )
        return layout

    def names(self, column: str) -> tuple[str, ...]:
        """Names of a column's dimensions; empty if there is no such column."""
        return dimension_names(self.features[column]) if column in self.features else ()

    def column(self, name: str) -> NDArray[Any]:
        """Read a numeric column (N, dim), in the order of the data's files."""
        parts = []
        for path in self.data_files:
            parts.append(column_of(read_table(path, name), name, path))
            if name in self.features and parts[-1].shape[1] != (width := math.prod(self.features[name]["shape"])):
                raise DatasetError(
                    f"{path} is damaged: its column {name} is {parts[-1].shape[1]} wide, not {width} as {INFO} says."
                )
        values = np.concatenate(parts)
        if len(values) != self.frames:
            raise DatasetError(
                f"{self.root / DATA} is incomplete: it holds {len(values)} frames, but {INFO} says {self.frames}."
            )
        return values

    def vectors(self, column: str) -> Floats:
        """Read a column of vectors (N, dim)."""
        return self.column(column).astype(np.float32)

    @cached_property
    def episodes(self) -> dict[int, slice]:
        """Rows of each episode, by its number."""
        numbers = self.column(EPISODE)[:, 0]
        slices = episode_slices(numbers)
        found = {int(numbers[rows.start]): rows for rows in slices}
        if numbers.dtype.kind not in "iu" or sorted(found) != list(range(len(slices))) or len(found) != self.count:
            raise DatasetError(
                f"{self.root / DATA} is damaged: its frames are not those of episodes 0 to {self.count - 1}, one after "
                "the other."
            )
        return found

    @property
    def count(self) -> int:
        """Number of episodes."""
        return self.info["total_episodes"]

    def rows(self, table: str, columns: Sequence[str], episode: int) -> list[dict[str, Any]]:
        """Read columns of :data:`DATA` or :data:`EPISODES`, in the rows of an episode."""
        filters = [(EPISODE, "==", episode)]
        with reading(self.root / table):
            rows = pq.read_table(self.root / table, columns=list(columns), filters=filters).to_pylist()
        if not rows:
            raise DatasetError(f"{self.root / table} has nothing of episode {episode}.")
        return rows

    @property
    def data_files(self) -> list[Path]:
        """Files that hold the frames, in order."""
        files = parquet_files(self.root / DATA)
        if not files:
            raise DatasetError(f"{self.root} holds no readable data.")
        return files

    def joints_column(self, layout: Layout) -> str | None:
        """Name of the column that holds the joint vectors of a layout as they were recorded, if there is one."""
        for column in (LEADER_JOINTS, SOURCE_JOINTS, SOURCE_ACTION, ACTION):
            encoded = column == ACTION and self.specified and commands_of(self.spec["space"]) != JOINT
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


def conversion(version: str, root: Path, repository: str = "") -> str:
    """How to convert a dataset of an older format: LeRobot's own command, and it keeps the hub as it is.

    Args:
        version: Of its format.
        root: Its folder; the converter replaces it, and leaves the old one beside it.
        repository: Its id on the hub, from where the converter downloads it if the folder is not there.
    """
    first = "" if version == "v2.1" else "to v2.1 with an older LeRobot, then "
    name = repository or f"local/{root.resolve().name}"
    options = f"--repo-id={name} --root={shlex.quote(str(root))} --push-to-hub=false"
    command = f"python -m lerobot.scripts.convert_dataset_v21_to_v30 {options}"
    return f"Convert it {first}with: {command} (the old one stays in {root.name}_old)"


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
        DatasetError: it is missing, or no JSON object.
    """
    if not (root / name).exists():
        raise DatasetError(f"{root} is not {kind}: it has no {name}.")
    return read_json(root / name, DatasetError)
