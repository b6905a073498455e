"""Some episodes of a dataset as a dataset, without a copy."""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.dataset import Dataset
from er_il.support.errors import DatasetError


@dataclass(frozen=True, eq=False)
class Selection(Dataset):
    """The frames of chosen episodes, under their numbers; metadata are those of the whole."""

    whole: Dataset
    chosen: tuple[int, ...]  # numbers of episodes, in ascending order

    @cached_property
    def info(self) -> dict[str, Any]:
        return self.whole.info

    @property
    def frames(self) -> int:
        return sum(rows.stop - rows.start for rows in self.episodes.values())

    @property
    def count(self) -> int:
        return len(self.chosen)

    @cached_property
    def episodes(self) -> dict[int, slice]:
        rows = [self.whole.episodes[number] for number in self.chosen]
        ends = accumulate((each.stop - each.start for each in rows), initial=0)
        return dict(zip(self.chosen, (slice(*each) for each in pairwise(ends)), strict=True))

    def column(self, name: str) -> NDArray[Any]:
        values = self.whole.column(name)
        return np.concatenate([values[self.whole.episodes[number]] for number in self.chosen])


def selected(dataset: Dataset, numbers: Collection[int]) -> Dataset:
    """The episodes of these numbers; all if none are given.

    Raises:
        DatasetError: there is none of such a number.
    """
    if missing := sorted(set(numbers) - set(dataset.episodes)):
        raise DatasetError(
            f"{dataset.root} has no episode {', '.join(map(str, missing))}. Valid: 0 to {dataset.count - 1}."
        )
    return Selection(dataset.root, dataset, tuple(sorted(set(numbers)))) if numbers else dataset
