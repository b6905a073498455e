"""Camera images of an episode of a LeRobot dataset."""

import io

import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray
from PIL import Image

from er_il.datasets.dataset import DATA, EPISODES, Dataset
from er_il.datasets.integrity import video_path
from er_il.datasets.schema import IMAGES
from er_il.support.errors import DatasetError

Frames = NDArray[np.uint8]  # (T, height, width, 3) RGB


def read_images(dataset: Dataset, number: int, length: int) -> dict[str, Frames]:
    """Read the images of an episode.

    Args:
        dataset: The dataset.
        number: Number of the episode.
        length: How many frames it has.

    Returns:
        Frames by camera; empty if there are no cameras.

    Raises:
        DatasetError: a video is missing or cannot be decoded.
    """
    kinds = {name: feature["dtype"] for name, feature in dataset.features.items() if name.startswith(IMAGES)}
    readers = {"video": _from_video, "image": _from_table}
    return {name.removeprefix(IMAGES): readers[kind](dataset, name, number, length) for name, kind in kinds.items()}


def _from_video(dataset: Dataset, name: str, number: int, length: int) -> Frames:
    chunk, file, start = (f"videos/{name}/{what}" for what in ("chunk_index", "file_index", "from_timestamp"))
    episode = dataset.rows(EPISODES, (chunk, file, start), number)[0]
    path = video_path(dataset, name, episode[chunk], episode[file])
    times = episode[start] + np.arange(length) / dataset.fps
    from lerobot.datasets.video_utils import decode_video_frames  # seconds of imports that states do without

    # torchcodec, LeRobot's first choice, needs a system-wide ffmpeg; PyAV brings its own.
    try:
        frames = decode_video_frames(path, times.tolist(), 0.5 / dataset.fps, backend="pyav", return_uint8=True)
    except (FFmpegError, OSError, RuntimeError, IndexError) as error:  # what it cannot open, find, or make out
        raise DatasetError(f"The video {path} is damaged: {' '.join(str(error).split())}.") from error
    return frames.permute(0, 2, 3, 1).numpy()


def _from_table(dataset: Dataset, name: str, number: int, length: int) -> Frames:
    pictures = (row[name]["bytes"] for row in dataset.rows(DATA, (name,), number))
    try:
        return np.stack([np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")) for picture in pictures])
    except (TypeError, ValueError, OSError) as error:  # no bytes, no picture (also truncated), or not of one size
        raise DatasetError(f"{dataset.root} holds no readable images of {name} in episode {number}: {error}") from error
