"""What a dataset holds apart from images, and where it comes from; read without LeRobot's seconds of imports."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from er_il.datasets.recipe import Recipe
from er_il.datasets.schema import DEMO_SEED, LEADER_JOINTS, STATE
from er_il.spaces.spec import ACTION, action_spec
from er_il.support.errors import DatasetError

Floats = NDArray[np.float32]

RECORD = Path("meta/recipe.json")
INFO = Path("meta/info.json")


@dataclass(frozen=True)
class Record:
    """The recipe of a dataset, and the demos that did not make it."""

    recipe: Recipe
    dropped: dict[int, str]  # demo seed -> why

    def write(self, dataset: Path) -> None:
        """Write the record into a dataset's folder."""
        values = {"recipe": self.recipe.to_dict(), "dropped": self.dropped}
        (dataset / RECORD).write_text(json.dumps(values, indent=2))

    @classmethod
    def read(cls, dataset: Path) -> "Record":
        """Read the record of a dataset.

        Raises:
            DatasetError: ``er-il generate`` did not write the dataset.
        """
        values = _read_json(dataset, RECORD)
        try:
            dropped = {int(seed): str(reason) for seed, reason in values["dropped"].items()}
            return cls(Recipe.from_dict(values["recipe"]), dropped)
        except (KeyError, TypeError, AttributeError, ValueError) as error:
            raise DatasetError(f"{dataset / RECORD} is not the record of a dataset.") from error


@dataclass(frozen=True, eq=False)
class Recorded:
    """One recorded episode of T control steps."""

    seed: int  # of the environment
    actions: Floats  # (T, dim) in the dataset's space
    leader: Floats  # (T, n + 1) leader's joint positions [rad] and gripper opening
    state: Floats  # (T, s) ``observation.state``; its first n entries are the follower's joints [rad]


def read_spec(dataset: Path) -> dict[str, Any]:
    """Return the specification of a dataset's action space.

    Raises:
        DatasetError: the folder is no dataset, or its actions are not specified.
    """
    return action_spec(_read_json(dataset, INFO).get("features", {}))


def read_episodes(dataset: Path) -> list[Recorded]:
    """Read the episodes of a dataset that ``er-il generate`` wrote, in order.

    Raises:
        DatasetError: the data is missing or lacks a column.
    """
    columns = [ACTION, LEADER_JOINTS, STATE, DEMO_SEED, "episode_index", "index"]
    try:
        table = pq.read_table(dataset / "data", columns=columns).sort_by("index")
    except (FileNotFoundError, pa.ArrowInvalid) as error:
        raise DatasetError(f"{dataset} holds no readable data.") from error
    if missing := [column for column in columns if column not in table.column_names]:
        raise DatasetError(f"{dataset} has no column {', '.join(missing)}: er-il generate did not write it.")
    ends = np.flatnonzero(np.diff(table.column("episode_index").to_numpy())) + 1
    actions, leader, state = (
        np.split(np.stack(table.column(name).to_numpy()), ends) for name in (ACTION, LEADER_JOINTS, STATE)
    )
    seeds = np.split(table.column(DEMO_SEED).to_numpy(), ends)
    return [Recorded(int(seeds[i][0]), actions[i], leader[i], state[i]) for i in range(len(seeds))]


def _read_json(dataset: Path, name: Path) -> dict[str, Any]:
    try:
        return json.loads((dataset / name).read_text())
    except (FileNotFoundError, NotADirectoryError) as error:
        raise DatasetError(f"{dataset} is not a dataset of er-il generate: it has no {name}.") from error
    except json.JSONDecodeError as error:
        raise DatasetError(f"{dataset / name} is not valid JSON.") from error
