"""Re-encoding: the same LeRobot dataset with its actions in another space, its videos shared."""

import functools
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from lerobot.datasets import DEFAULT_EPISODES_PATH, aggregate_stats, write_stats
from lerobot.datasets.compute_stats import compute_episode_stats
from lerobot.datasets.feature_utils import get_hf_features_from_features
from lerobot.datasets.io_utils import load_info, load_stats, write_info, write_table_one_row_group_per_episode
from numpy.typing import NDArray

from er_il.errors import DatasetError
from er_il.schema import ACTION, LEADER_JOINTS, Feature, action_feature, action_spec
from er_il.spaces import ActionSpace, JointSpace

Floats = NDArray[np.float32]
Stats = dict[str, dict[str, NDArray[Any]]]

_EPISODE = "episode_index"
_EPISODES = Path(DEFAULT_EPISODES_PATH).parts[:2]  # meta/episodes
_VIDEOS, _DATA = "videos", "data"


def encode_actions(joints: Floats, space: ActionSpace) -> Floats:
    """Encode one episode's joint angles [rad] and gripper, (T, n + 1), as actions (T, dim).

    A whole episode at once, so that rotations stay continuous within it.
    """
    return space.encode(joints[:, :-1], joints[:, -1]).astype(np.float32)


def encode_dataset(source: Path, target: Path, space: ActionSpace) -> None:
    """Write ``source`` again as ``target`` with actions in ``space``.

    Only the action column, its feature and its statistics differ, and they are what LeRobot would
    have written had the dataset been recorded in that space. Videos are hard links where the file
    system allows. The source stays as it is; the target appears only when complete.

    Raises:
        DatasetError: the source is no LeRobot v3 dataset, or does not hold the joint angles of this arm.
        FileExistsError: the target exists.
    """
    if target.exists():
        raise FileExistsError(17, "The target exists already", str(target))
    try:
        info = load_info(source)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise DatasetError(f"{source} is not a LeRobot v3 dataset: it has no meta/info.json.") from error
    column = _joints_column(info.features, space)
    info.features[ACTION] = action_feature(space)
    partial = target.with_name(target.name + ".partial")
    shutil.rmtree(partial, ignore_errors=True)
    _copy(source, partial)
    schema = get_hf_features_from_features(info.features).arrow_schema
    stats: dict[int, Stats] = {}
    for path in _parquet_files(source / _DATA):
        table, found = _encode_table(pq.read_table(path), column, space, schema)
        stats |= {episode: compute_episode_stats({ACTION: rows}, info.features) for episode, rows in found.items()}
        copy = partial / path.relative_to(source)
        copy.parent.mkdir(parents=True, exist_ok=True)
        write_table_one_row_group_per_episode(table, copy)
    for path in _parquet_files(source.joinpath(*_EPISODES)):
        copy = partial / path.relative_to(source)
        copy.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(_with_stats(pq.read_table(path), stats), copy)
    # LeRobot adds one episode after the other; the same order gives the same digits.
    total: Stats = functools.reduce(lambda sofar, each: aggregate_stats([sofar, each]), _in_order(stats))
    write_stats((load_stats(source) or {}) | total, partial)
    write_info(info, partial)
    partial.rename(target)


def _joints_column(columns: dict[str, Feature], space: ActionSpace) -> str:
    """Name of the column that holds the arm's joint angles and gripper."""
    names = list(JointSpace(space.arm).names)
    for column in (LEADER_JOINTS, ACTION):
        if column in columns and list(columns[column].get("names") or ()) == names:
            if column == ACTION and action_spec(columns)["space"] != JointSpace.kind:
                continue
            return column
    raise DatasetError(
        f"The dataset has no joint angles to encode: neither {LEADER_JOINTS} nor {ACTION} is named {', '.join(names)}."
    )


def _encode_table(
    table: pa.Table, column: str, space: ActionSpace, schema: pa.Schema
) -> tuple[pa.Table, dict[int, Floats]]:
    """Replace the action column; also return each episode's actions."""
    joints = np.stack(table.column(column).to_numpy()).astype(np.float32)
    episodes = table.column(_EPISODE).to_numpy()
    starts = np.flatnonzero(np.diff(episodes, prepend=-1))
    actions = {
        int(episodes[start]): encode_actions(rows, space)
        for start, rows in zip(starts, np.split(joints, starts[1:]), strict=True)
    }
    field = schema.field(ACTION)
    values = pa.array(np.concatenate(list(actions.values())).tolist(), type=field.type)
    table = table.set_column(table.schema.get_field_index(ACTION), field, values)
    return table.replace_schema_metadata(schema.metadata), actions


def _with_stats(episodes: pa.Table, stats: dict[int, Stats]) -> pa.Table:
    """Replace the statistics of the actions in a table of episodes."""
    rows = [stats[episode][ACTION] for episode in episodes.column(_EPISODE).to_pylist()]
    for name in rows[0]:
        column, values = f"stats/{ACTION}/{name}", pa.array([row[name].tolist() for row in rows])
        index = episodes.schema.get_field_index(column)
        episodes = episodes.append_column(column, values) if index < 0 else episodes.set_column(index, column, values)
    return episodes


def _in_order(stats: dict[int, Stats]) -> Iterator[Stats]:
    return (stats[episode] for episode in sorted(stats))


def _copy(source: Path, target: Path) -> None:
    """Copy all that does not depend on the actions; link the videos."""
    shutil.copytree(source, target, ignore=_except(source, {_DATA, _VIDEOS, str(Path(*_EPISODES))}))
    if (source / _VIDEOS).exists():
        shutil.copytree(source / _VIDEOS, target / _VIDEOS, copy_function=_link)


def _except(root: Path, folders: set[str]) -> Callable[[str, list[str]], set[str]]:
    def ignored(folder: str, names: list[str]) -> set[str]:
        return {name for name in names if str((Path(folder) / name).relative_to(root)) in folders}

    return ignored


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:  # another file system, or one without hard links
        shutil.copy2(source, target)


def _parquet_files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*/*.parquet"))
