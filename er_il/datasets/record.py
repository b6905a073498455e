"""Recipe and episodes of a dataset that ``er-il generate`` wrote."""

import json
from dataclasses import dataclass
from pathlib import Path

from er_il.datasets.dataset import Dataset, Floats, read_metadata
from er_il.datasets.recipe import Recipe
from er_il.datasets.schema import DEMO_SEED, LEADER_JOINTS, STATE
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError, ErIlError

RECORD = Path("meta/recipe.json")


@dataclass(frozen=True)
class DatasetRecord:
    """The recipe of a dataset, and the demos that did not make it."""

    recipe: Recipe
    dropped: dict[int, str]  # demo seed -> why

    def write(self, dataset: Path) -> None:
        """Write the record into a dataset's folder."""
        values = {"recipe": self.recipe.to_dict(), "dropped": self.dropped}
        (dataset / RECORD).write_text(json.dumps(values, indent=2))

    @classmethod
    def read(cls, dataset: Path) -> "DatasetRecord":
        """Read the record of a dataset.

        Raises:
            DatasetError: ``er-il generate`` did not write the dataset.
        """
        values = read_metadata(dataset, RECORD, "a dataset of er-il generate")
        try:
            dropped = {int(seed): str(reason) for seed, reason in values["dropped"].items()}
            return cls(Recipe.from_dict(values["recipe"]), dropped)
        except ErIlError as error:
            raise DatasetError(f"{dataset / RECORD} is damaged: {error}") from error
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise DatasetError(f"{dataset / RECORD} is not the record of a dataset.") from error


@dataclass(frozen=True, eq=False)
class RecordedEpisode:
    """One recorded episode of T control steps."""

    seed: int  # of the environment
    actions: Floats  # (T, dim) in the dataset's space
    leader: Floats  # (T, n + 1) leader's joint positions [rad] and gripper opening
    state: Floats  # (T, s) ``observation.state``; its first n entries are the follower's joints [rad]


def read_episodes(root: Path) -> list[RecordedEpisode]:
    """Read the episodes of a dataset that ``er-il generate`` wrote, in order.

    Raises:
        DatasetError: the data is missing or lacks a column.
    """
    dataset = Dataset(root)
    if missing := [column for column in (LEADER_JOINTS, STATE, DEMO_SEED) if column not in dataset.features]:
        raise DatasetError(f"{root} has no column {', '.join(missing)}: er-il generate did not write it.")
    actions, leader, state = (dataset.vectors(name) for name in (ACTION, LEADER_JOINTS, STATE))
    seeds = dataset.column(DEMO_SEED)[:, 0]
    return [
        RecordedEpisode(int(seeds[rows.start]), actions[rows], leader[rows], state[rows])
        for rows in dataset.episodes.values()
    ]
