"""What the cameras of a LeRobot dataset saw during an episode."""

import io
from pathlib import Path

import numpy as np
from lerobot.datasets.utils import DatasetInfo
from lerobot.datasets.video_utils import decode_video_frames
from numpy.typing import NDArray
from PIL import Image

from er_il.datasets.schema import IMAGES
from er_il.support.errors import DatasetError
from er_il.viewer.column import DATA, EPISODES, read_rows

Frames = NDArray[np.uint8]  # (T, height, width, 3) RGB


def read_images(dataset: Path, info: DatasetInfo, number: int, length: int) -> dict[str, Frames]:
    """Read the images of an episode.

    Args:
        dataset: Folder of the dataset.
        info: Its metadata.
        number: Number of the episode.
        length: How many frames it has.

    Returns:
        Frames by camera; empty if there are no cameras.

    Raises:
        DatasetError: a video is missing or cannot be decoded.
    """
    kinds = {name: feature["dtype"] for name, feature in info.features.items() if name.startswith(IMAGES)}
    readers = {"video": _from_video, "image": _from_table}
    return {
        name.removeprefix(IMAGES): readers[kind](dataset, info, name, number, length) for name, kind in kinds.items()
    }


def _from_video(dataset: Path, info: DatasetInfo, name: str, number: int, length: int) -> Frames:
    chunk, file, start = (f"videos/{name}/{what}" for what in ("chunk_index", "file_index", "from_timestamp"))
    episode = read_rows(dataset, EPISODES, (chunk, file, start), number)[0]
    assert info.video_path is not None
    path = dataset / info.video_path.format(video_key=name, chunk_index=episode[chunk], file_index=episode[file])
    if not path.is_file():
        raise DatasetError(f"The video {path} is missing.")
    times = episode[start] + np.arange(length) / info.fps
    # torchcodec, LeRobot's first choice, needs a system-wide ffmpeg; PyAV brings its own.
    frames = decode_video_frames(path, times.tolist(), 0.5 / info.fps, backend="pyav", return_uint8=True)
    return frames.permute(0, 2, 3, 1).numpy()


def _from_table(dataset: Path, info: DatasetInfo, name: str, number: int, length: int) -> Frames:
    pictures = (row[name]["bytes"] for row in read_rows(dataset, DATA, (name,), number))
    return np.stack([np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")) for picture in pictures])
