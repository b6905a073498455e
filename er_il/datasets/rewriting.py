"""Writing a copy of a LeRobot v3 dataset in which some columns of vectors are replaced or added."""

import functools
import os
import shutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from lerobot.datasets import aggregate_stats, write_stats
from lerobot.datasets.compute_stats import compute_episode_stats
from lerobot.datasets.feature_utils import get_hf_features_from_features
from lerobot.datasets.io_utils import load_info, load_stats, write_info, write_table_one_row_group_per_episode
from numpy.typing import NDArray

from er_il.datasets.dataset import DATA, EPISODE, EPISODES, Dataset, Floats
from er_il.datasets.schema import Feature
from er_il.datasets.tables import episode_slices, parquet_files, read_table
from er_il.support.links import TOOLS, check_links

Stats = dict[str, dict[str, NDArray[Any]]]
Advance = Callable[[int], object]  # called with the number of frames done since the last call

_VIDEOS = "videos"


@dataclass(frozen=True, eq=False)
class Column:
    """A column of vectors."""

    feature: Feature
    values: Floats  # (N, dim), a row a frame, in the order of the data's files


@dataclass(frozen=True)
class Copy:
    """A column of the source under another name, with its values and statistics there."""

    feature: Feature
    of: str


def rewrite(
    source: Dataset,
    target: Path,
    columns: Mapping[str, Column],
    copies: Mapping[str, Copy],
    dropped: Collection[str] = (),
    advance: Advance = lambda frames: None,
) -> None:
    """Write ``source`` as ``target`` with columns replaced, added or left out.

    These columns, their features and their statistics are what LeRobot would have written; all else
    stays. Videos are hard links where the file system allows.

    Args:
        source: The dataset.
        target: Folder that does not exist.
        columns: Columns of the target that the source lacks or has otherwise.
        copies: Columns of the target that the source has under other names.
        dropped: Columns that the source has and the target has not.
        advance: Told about progress.

    Raises:
        ErIlError: a symbolic link leads out of the source.
    """
    check_links(source.root)
    info = load_info(source.root)
    info.features |= {name: each.feature for name, each in [*columns.items(), *copies.items()]}
    info.features = {name: feature for name, feature in info.features.items() if name not in dropped}
    _copy(source.root, target)
    schema = get_hf_features_from_features(info.features).arrow_schema
    stats: dict[int, Stats] = {}
    done = 0
    for path in source.data_files:
        table = read_table(path)
        rows = slice(done, done + len(table))
        done = rows.stop
        values = {name: column.values[rows] for name, column in columns.items()}
        for frames in episode_slices(table.column(EPISODE).to_numpy()):
            episode: dict[str, list[str] | NDArray[Any]] = {name: array[frames] for name, array in values.items()}
            stats[table.column(EPISODE)[frames.start].as_py()] = compute_episode_stats(episode, info.features)
            advance(frames.stop - frames.start)
        table = _with_copies(table, copies, schema).drop_columns(list(dropped))
        table = _with_columns(table, values, schema)
        write_table_one_row_group_per_episode(table, _new(target, source.root, path))
    for path in parquet_files(source.root / EPISODES):
        episodes = _without_stats(_with_copied_stats(read_table(path), copies), dropped)
        episodes = _with_stats(episodes, stats)
        pq.write_table(episodes, _new(target, source.root, path))
    before = load_stats(source.root) or {}
    copied = {name: before[copy.of] for name, copy in copies.items() if copy.of in before}
    kept = {name: own for name, own in before.items() if name not in dropped}
    write_stats(kept | copied | _total(stats), target)
    write_info(info, target)


def replace_statistics(root: Path, stats: Mapping[int, Stats]) -> None:
    """Give columns of a dataset other statistics, of each episode and of all.

    Args:
        root: Folder of the dataset.
        stats: Statistics of the columns, by episode.
    """
    for path in parquet_files(root / EPISODES):
        pq.write_table(_with_stats(read_table(path), stats), path)
    write_stats((load_stats(root) or {}) | _total(stats), root)


def _total(stats: Mapping[int, Stats]) -> Stats:
    """Statistics of all episodes. LeRobot adds one after the other; the same order gives the same digits."""
    return functools.reduce(lambda sofar, each: aggregate_stats([sofar, each]), (stats[key] for key in sorted(stats)))


def _with_columns(table: pa.Table, values: Mapping[str, Floats], schema: pa.Schema) -> pa.Table:
    for name, rows in values.items():
        field = schema.field(name)
        array = pa.FixedSizeListArray.from_arrays(pa.array(rows.ravel()), rows.shape[1])
        table = _with_column(table, field, array.cast(field.type))
    return table.replace_schema_metadata(schema.metadata)


def _with_copies(table: pa.Table, copies: Mapping[str, Copy], schema: pa.Schema) -> pa.Table:
    for name, copy in copies.items():
        field = schema.field(name)
        table = _with_column(table, field, table.column(copy.of).cast(field.type))
    return table


def _with_stats(episodes: pa.Table, stats: Mapping[int, Stats]) -> pa.Table:
    """Replace the statistics of columns in a table of episodes."""
    rows = [stats[episode] for episode in episodes.column(EPISODE).to_pylist()]
    for feature in rows[0]:
        for statistic in rows[0][feature]:
            values = pa.array([row[feature][statistic].tolist() for row in rows])
            episodes = _with_column(episodes, f"stats/{feature}/{statistic}", values)
    return episodes


def _with_copied_stats(episodes: pa.Table, copies: Mapping[str, Copy]) -> pa.Table:
    for name, copy in copies.items():
        prefix = f"stats/{copy.of}/"
        for column in [each for each in episodes.column_names if each.startswith(prefix)]:
            statistic = column.removeprefix(prefix)
            episodes = _with_column(episodes, f"stats/{name}/{statistic}", episodes.column(column))
    return episodes


def _without_stats(episodes: pa.Table, names: Collection[str]) -> pa.Table:
    prefixes = tuple(f"stats/{name}/" for name in names)
    return episodes.drop_columns([column for column in episodes.column_names if column.startswith(prefixes)])


def _with_column(table: pa.Table, field: pa.Field | str, values: pa.Array | pa.ChunkedArray) -> pa.Table:
    """Replace a column of a table, or add it."""
    index = table.schema.get_field_index(field if isinstance(field, str) else field.name)
    return table.append_column(field, values) if index < 0 else table.set_column(index, field, values)


def _copy(source: Path, target: Path) -> None:
    """Copy all that does not depend on the columns; link the videos."""
    shutil.copytree(source, target, ignore=_except(source, {DATA, _VIDEOS, EPISODES, *TOOLS}))
    if (source / _VIDEOS).exists():
        shutil.copytree(source / _VIDEOS, target / _VIDEOS, copy_function=_link)


def _except(root: Path, folders: set[str]) -> Callable[[str, list[str]], set[str]]:
    def ignored(folder: str, names: list[str]) -> set[str]:
        return {name for name in names if str((Path(folder) / name).relative_to(root)) in folders}

    return ignored


def _link(source: str, target: str) -> None:
    file = os.path.realpath(source)  # the hub's cache holds links to files
    try:
        os.link(file, target)
    except OSError:  # another file system, or one without hard links
        shutil.copy2(file, target)


def _new(target: Path, source: Path, path: Path) -> Path:
    copy = target / path.relative_to(source)
    copy.parent.mkdir(parents=True, exist_ok=True)
    return copy
