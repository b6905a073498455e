"""Where joint values are read from: some or all dimensions of a column, of this dataset or of another one."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.hub import find_dataset
from er_il.datasets.schema import SOURCE_JOINTS
from er_il.support.errors import DatasetError, UnknownNameError

COMMANDED = re.compile(r"action|command|cmd|control|desired|goal|leader|master|target", re.I)  # in names of columns


@dataclass(frozen=True)
class ColumnSource:
    """Dimensions of a column of a dataset."""

    dataset: Dataset
    column: str
    names: tuple[str, ...]  # of the dimensions

    @classmethod
    def parse(cls, text: str, dataset: Dataset) -> "ColumnSource":
        """Read ``COLUMN``, ``COLUMN:NAME,NAME`` or either after ``DATASET:``, a folder or repository id.

        Args:
            text: What was given.
            dataset: The dataset whose columns need no ``DATASET:``.

        Raises:
            UnknownNameError: there is no such column or dimension.
            DatasetError: there is no such dataset, its episodes or frames are others, or the column holds no vectors.
        """
        words = text.split(":")
        owner = dataset
        if words[0] not in dataset.features and len(words) > 1:
            owner = _other_dataset(words.pop(0), dataset)
        column, *chosen = words
        if column not in owner.features:
            raise UnknownNameError(f"column of {owner.root}", column, vector_columns(owner))
        feature = owner.features[column]
        if len(feature["shape"]) != 1 or not feature["dtype"].startswith(("float", "int")):
            raise DatasetError(f"The column {column} of {owner.root} holds no vectors of numbers.")
        names = owner.names(column)
        wanted = tuple(name for words in chosen for name in words.split(","))
        for name in wanted:
            if name not in names:
                raise UnknownNameError(f"dimension of {column}", name, names)
        return cls(owner, column, wanted or names)

    @property
    def text(self) -> str:
        """The column, and its dimensions if they are not all, as :meth:`parse` reads them."""
        some = "" if self.names == self.dataset.names(self.column) else f":{','.join(self.names)}"
        return f"{self.column}{some}"

    @property
    def measured(self) -> bool:
        """True unless the column's name says that its values were commanded."""
        return self.column != SOURCE_JOINTS and not COMMANDED.search(self.column)

    @cached_property
    def named(self) -> bool:
        """True if the dimensions have names, not numbers only."""
        return not all(name.isdecimal() for name in self.names)

    def read(self) -> Floats:
        """The values (N, k) as they were recorded."""
        every = self.dataset.names(self.column)
        return self.dataset.vectors(self.column)[:, [every.index(name) for name in self.names]]

    def commands(self) -> Floats:
        """The values (N, k) as commands: of what was measured, each frame's are those of the next.

        That is where the robot was sent, as far as it got. The last frame of an episode has no next one and commands
        itself: the arm stays. No frame is left out, so that episodes keep their lengths, videos and other columns.
        """
        values = self.read()
        return following(values, self.dataset.episodes.values()) if self.measured else values


def following(values: Floats, episodes: Iterable[slice]) -> Floats:
    """The next row of each row (N, k) within its episode; the last one of an episode stays."""
    rows = np.arange(len(values)) + 1
    ends = [each.stop - 1 for each in episodes]
    rows[ends] = ends
    return values[rows]


def _other_dataset(name: str, dataset: Dataset) -> Dataset:
    if "/" not in name and not Path(name).exists():
        raise UnknownNameError("column, or folder of a dataset,", name, vector_columns(dataset))
    other = Dataset(find_dataset(name))
    check_same_frames(dataset, other)
    return other


def vector_columns(dataset: Dataset) -> list[str]:
    """Names of the columns that hold vectors of numbers."""
    return [
        name
        for name, each in dataset.features.items()
        if len(each["shape"]) == 1 and each["shape"][0] > 1 and each["dtype"].startswith(("float", "int"))
    ]


def check_same_frames(one: Dataset, other: Dataset) -> None:
    """Refuse two datasets that are not of the same episodes, frame by frame.

    Raises:
        DatasetError: says what differs.
    """
    for what, values in (
        ("frames a second", (one.fps, other.fps)),
        ("episodes", (len(one.episodes), len(other.episodes))),
    ):
        if values[0] != values[1]:
            raise DatasetError(f"{other.root} has {values[1]} {what}, {one.root} has {values[0]}: they do not match.")
    for number, rows in one.episodes.items():
        own, theirs = (each.stop - each.start for each in (rows, other.episodes[number]))
        if own != theirs or rows != other.episodes[number]:
            raise DatasetError(
                f"Episode {number} of {other.root} has {theirs} frames, that of {one.root} {own}: they do not match."
            )
