"""The evaluations of an agent on its way."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from er_il.support.atomic_files import write_json
from er_il.support.errors import PolicyError
from er_il.support.json_files import read_json

LEARNING = "learning.json"  # in the folder of a training


@dataclass(frozen=True)
class Milestone:
    """An evaluation on the way."""

    steps: int  # decisions learnt from
    successes: int
    episodes: int
    invalid_rate: float  # of the decisions since the last milestone, which explore


def write_milestones(folder: Path, milestones: Sequence[Milestone]) -> None:
    """Write the evaluations so far into the folder of a training."""
    write_json(folder / LEARNING, {"milestones": [vars(each) for each in milestones]})


def read_milestones(folder: Path) -> list[Milestone]:
    """Read what :func:`write_milestones` wrote.

    Raises:
        PolicyError: the file is missing or damaged.
    """
    try:
        return [Milestone(**each) for each in read_json(folder / LEARNING, PolicyError)["milestones"]]
    except (KeyError, TypeError) as error:
        raise PolicyError(f"{folder / LEARNING} is damaged: it holds no evaluations.") from error
