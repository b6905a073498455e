"""What else than actions a LeRobot v3 dataset needs to be whole: episodes, tasks, statistics and videos."""

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from er_il.datasets.dataset import EPISODE, EPISODES, INFO, Dataset
from er_il.datasets.schema import STATE
from er_il.datasets.tables import parquet_files, read_table, reading
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError
from er_il.support.json_files import read_json

TASKS, STATS = Path("meta/tasks.parquet"), Path("meta/stats.json")
STATISTICS = ("mean", "std", "min", "max")  # by which policies normalise
TASK = "task_index"
_FROM, _TO = "dataset_from_index", "dataset_to_index"
_NEEDED = (EPISODE, _FROM, _TO, "length", "data/chunk_index", "data/file_index")
_SHORT = 1.5  # [frames] that a video may be shorter than its episodes: LeRobot reads no frame that far from its time


def check_whole(dataset: Dataset) -> None:
    """Check what LeRobot reads beside the frames, without LeRobot, whose own errors name no file.

    Raises:
        DatasetError: something is missing, damaged, or contradicts the frames; names the file.
    """
    _ = dataset.info  # raises if it is no dataset of this version
    episodes = _episodes(dataset)
    _check_columns(dataset)
    _check_tasks(dataset)
    _check_stats(dataset)
    for name in (name for name, feature in dataset.features.items() if feature["dtype"] == "video"):
        for path, end in _videos(dataset, name, episodes):
            _check_video(path, end, dataset.fps)


def _episodes(dataset: Dataset) -> pa.Table:
    """The table of episodes, checked against the frames."""
    files = parquet_files(dataset.root / EPISODES)
    if not files:
        raise DatasetError(f"{dataset.root} has no table of episodes in {EPISODES}.")
    videos = [name for name, feature in dataset.features.items() if feature["dtype"] == "video"]
    needed = [*_NEEDED, *(f"videos/{name}/{what}" for name in videos for what in ("chunk_index", "file_index"))]
    needed += [f"videos/{name}/{what}_timestamp" for name in videos for what in ("from", "to")]
    tables = []
    for path in files:
        table = read_table(path, *needed)
        for name in needed:
            if name not in table.column_names:
                raise DatasetError(f"{path} has no column {name}.")
            column = table.column(name)
            if column.null_count or not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
                raise DatasetError(f"{path} is damaged: its column {name} does not hold a number an episode.")
        tables.append(table)
    found = pa.concat_tables(tables)
    described = {row[EPISODE]: (row[_FROM], row[_TO], row["length"]) for row in found.to_pylist()}
    actual = {number: (each.start, each.stop, each.stop - each.start) for number, each in dataset.episodes.items()}
    if described != actual or len(found) != len(actual):
        raise DatasetError(
            f"{dataset.root / EPISODES} is damaged: it does not describe the episodes that the data hold."
        )
    return found


def _check_columns(dataset: Dataset) -> None:
    """Every column that the metadata name is in every file of the data; videos have files of their own."""
    named = [name for name, feature in dataset.features.items() if feature["dtype"] != "video"]
    for path in dataset.data_files:
        with reading(path):
            held = pq.read_schema(path).names
        if missing := [name for name in named if name not in held]:
            raise DatasetError(f"{path} has no column {', '.join(missing)}, though the dataset's metadata name it.")


def _check_tasks(dataset: Dataset) -> None:
    path = dataset.root / TASKS
    table = read_table(path)
    if TASK not in table.column_names or not pa.types.is_integer(table.column(TASK).type):
        raise DatasetError(f"{path} is damaged: it numbers no tasks in a column {TASK}.")
    texts = [name for name in table.column_names if name != TASK]
    if not texts or not all(pa.types.is_string(table.column(name).type) for name in texts):
        raise DatasetError(f"{path} is damaged: it says no task in words.")
    if sorted(table.column(TASK).to_pylist()) != list(range(len(table))):
        raise DatasetError(f"{path} is damaged: its tasks are not numbered from 0.")
    used = dataset.column(TASK)
    if used.min() < 0 or used.max() >= len(table):
        raise DatasetError(f"{path} lacks the task {used.max()}, which the frames have.")


def _check_stats(dataset: Dataset) -> None:
    path = dataset.root / STATS
    stats = read_json(path, DatasetError)
    for name in (each for each in (ACTION, STATE) if each in dataset.features):
        width = len(dataset.names(name))
        of_column = stats.get(name)
        for statistic in STATISTICS:
            values = of_column.get(statistic) if isinstance(of_column, dict) else None
            if not _numbers(values, width):
                raise DatasetError(f"{path} is damaged: the {statistic} of {name} is not a list of {width} numbers.")
    for name, of_column in stats.items():
        if not isinstance(of_column, dict) or not all(_numbers(values) for values in of_column.values()):
            raise DatasetError(f"{path} is damaged: what it says of {name} is no statistics.")


def _numbers(values: Any, width: int | None = None) -> bool:
    array = number_list(values)
    return array is not None and bool(np.isfinite(array).all()) and width in (None, len(array.ravel()))


def number_list(values: Any) -> NDArray[np.float64] | None:
    """A list of numbers, or of such lists, in a JSON file as an array; None if it is anything else."""
    try:
        return np.asarray(values, dtype=np.float64) if isinstance(values, list) else None
    except (TypeError, ValueError):
        return None


def _videos(dataset: Dataset, name: str, episodes: pa.Table) -> Iterator[tuple[Path, float]]:
    """Each video file of a camera, and the time [s] at which its last episode ends."""
    ends: dict[Path, float] = {}
    for row in episodes.to_pylist():
        path = video_path(dataset, name, row[f"videos/{name}/chunk_index"], row[f"videos/{name}/file_index"])
        ends[path] = max(ends.get(path, 0.0), row[f"videos/{name}/to_timestamp"])
    yield from ends.items()


def video_path(dataset: Dataset, name: str, chunk: int, file: int) -> Path:
    """Path of a video of a camera.

    Raises:
        DatasetError: the dataset does not say where its videos are, or has none there.
    """
    pattern = dataset.info.get("video_path") or ""
    try:
        path = dataset.root / pattern.format(video_key=name, chunk_index=int(chunk), file_index=int(file))
    except (KeyError, IndexError, ValueError, AttributeError) as error:
        raise DatasetError(f"{dataset.root / INFO} is damaged: video_path is {pattern!r}.") from error
    if not path.is_file():
        raise DatasetError(f"The video {path} is missing.")
    return path


def _check_video(path: Path, end: float, fps: float) -> None:
    import av  # of videos only
    from av.error import FFmpegError

    length = 0.0
    try:
        with av.open(str(path)) as container:
            stream = container.streams.video[0]
            unit = stream.time_base or Fraction(1, 1)
            container.seek(int(end / unit), stream=stream)  # to the last picture that stands for itself
            for packet in container.demux(stream):  # the header's duration is there in a truncated file, too
                if packet.size and packet.pts is not None and not packet.is_corrupt:
                    length = max(length, float((packet.pts + (packet.duration or 0)) * unit))
    except (FFmpegError, OSError, IndexError) as error:
        raise DatasetError(f"The video {path} is damaged: {' '.join(str(error).split())}.") from error
    if length < end - _SHORT / fps:
        raise DatasetError(f"The video {path} is damaged: it lasts {length:.2f} s, its episodes end at {end:.2f} s.")
