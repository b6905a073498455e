"""``lerobot-train`` with its frames kept in memory: the same batches and the same policy, in less time.

LeRobot looks up every frame through Hugging Face datasets and decodes a video for every image. For a
small policy that takes longer than the training itself, and demonstrations of one task fit into
memory. Takes the arguments of ``lerobot-train``: ``python -m er_il.policy.in_memory --config_path=...``.
"""

import math
import os
import sys
from collections.abc import Callable
from typing import Any

import torch
from lerobot.configs.train import TrainPipelineConfig
from lerobot.datasets import LeRobotDataset
from lerobot.scripts import lerobot_train

from datasets import Dataset
from er_il.policy import chunk_pipelines, safeguards
from er_il.support.failures import REPORT, explanation

SHARE = 0.5  # of the free memory that images may take


class Frames:
    """The rows of a dataset as tensors, looked up as LeRobot looks up rows."""

    def __init__(self, rows: Dataset) -> None:
        self.data = rows.data  # LeRobot reads whole columns from it
        self._columns: dict[str, Any] = rows[:]

    def __len__(self) -> int:
        return len(self.data)

    def __getitem__(self, key: int | str) -> Any:
        if isinstance(key, str):
            return _Column(self._columns[key])
        return {name: column[key] for name, column in self._columns.items()}


class _Column:
    def __init__(self, values: list[torch.Tensor]) -> None:
        self._values = values

    def __getitem__(self, rows: list[int]) -> list[torch.Tensor]:
        return [self._values[row] for row in rows]


class Images:
    """LeRobot's video decoder, which remembers what it has decoded."""

    def __init__(self, decode: Callable[[dict[str, list[float]], int], dict[str, torch.Tensor]]) -> None:
        self._decode = decode
        self._decoded: dict[tuple[int, str], dict[str, torch.Tensor]] = {}

    def __call__(self, timestamps: dict[str, list[float]], episode: int) -> dict[str, torch.Tensor]:
        key = episode, str(timestamps)
        if key not in self._decoded:
            self._decoded[key] = self._decode(timestamps, episode)
        return self._decoded[key]


def keep_in_memory(dataset: LeRobotDataset, processes: int = 1) -> None:
    """Keep a dataset's rows in memory at once, and each image from its first decoding on if they all fit.

    Args:
        dataset: A dataset to read from.
        processes: Number of processes that will each read, and remember, images.
    """
    reader: Any = dataset.reader
    reader.hf_dataset = Frames(dataset.hf_dataset)
    pixels = sum(math.prod(dataset.features[key]["shape"]) for key in dataset.meta.video_keys)
    free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if pixels * len(dataset) * processes < SHARE * free:
        reader._query_videos = Images(reader._query_videos)


def main() -> None:
    """Run LeRobot's command on datasets in memory."""
    make = lerobot_train.make_train_eval_datasets

    def make_in_memory(config: TrainPipelineConfig) -> Any:
        both = make(config)
        for dataset in both:
            if isinstance(dataset, LeRobotDataset):
                keep_in_memory(dataset, max(1, config.num_workers))
        return both

    lerobot_train.make_train_eval_datasets = make_in_memory  # pyrefly: ignore[bad-assignment]
    chunk_pipelines.install()
    safeguards.install()
    mistake = None
    try:
        lerobot_train.main()
    except Exception as error:
        mistake = explanation(error)
        if mistake is None:
            error.add_note(REPORT)
            raise
    if mistake:  # told here, where the exception no longer holds LeRobot's progress bar: below that
        print(f"error: {mistake}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
