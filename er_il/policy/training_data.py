"""Checks of what a training reads: the numbers of its columns, and the statistics that normalise them."""

from collections.abc import Iterable

import numpy as np

from er_il.datasets.dataset import Dataset, read_metadata
from er_il.datasets.integrity import STATISTICS, STATS, number_list
from er_il.datasets.number_checks import check_numbers
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError

OBSERVATION = "observation."


def check_training_data(dataset: Dataset, inputs: Iterable[str]) -> None:
    """Refuse a dataset on which a training would learn from numbers that cannot be, or divide by nothing.

    Args:
        dataset: The dataset.
        inputs: Columns that the policy sees, all observations if there are none; cameras are left to LeRobot.

    Raises:
        DatasetError: says all that is wrong with the numbers, else with the statistics.
    """
    seen = list(inputs) or [name for name in dataset.features if name.startswith(OBSERVATION)]
    vectors = [name for name in seen if name in dataset.features and len(dataset.features[name]["shape"]) == 1]
    check_numbers(dataset, dataset.layout, vectors)
    stats = read_metadata(dataset.root, STATS, "a dataset to train on")
    wrong = [text for name in dict.fromkeys([ACTION, *vectors]) for text in _damage(dataset, name, stats)]
    if wrong:
        raise DatasetError(
            f"The statistics of {dataset.root} in {STATS} are damaged: {'; '.join(wrong)}. "
            "Write the dataset again (er-il encode DATASET --to SPACE --out OUT computes those of the actions)."
        )


def _damage(dataset: Dataset, column: str, stats: object) -> list[str]:
    """What is wrong with the statistics of a column of vectors (N, D)."""
    own = stats.get(column) if isinstance(stats, dict) else None
    if not isinstance(own, dict):
        return [f"{column} has none"]
    if missing := [name for name in STATISTICS if name not in own]:
        return [f"{column} has no {', '.join(missing)}"]
    values = dataset.vectors(column)
    varies = np.ptp(values, axis=0) > 0
    found, read = [], {}
    for name in STATISTICS:
        numbers = number_list(own[name])
        if numbers is None or numbers.shape != varies.shape:
            found.append(f"{column} {name} is no list of {len(varies)} numbers")
        elif bad := _names(dataset, column, ~np.isfinite(numbers)):
            found.append(f"{column} {name} is not finite for {bad}")
        else:
            read[name] = numbers
    if "std" in read and (bad := _names(dataset, column, (read["std"] < 0) | ((read["std"] == 0) & varies))):
        found.append(f"{column} std is not positive for {bad}, which varies")
    if "min" in read and "max" in read and (bad := _names(dataset, column, (read["min"] >= read["max"]) & varies)):
        found.append(f"{column} min is not below max for {bad}, which varies")
    return found


def _names(dataset: Dataset, column: str, chosen: np.ndarray) -> str:
    return ", ".join(name for name, each in zip(dataset.names(column), chosen, strict=True) if each)
