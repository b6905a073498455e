"""Cells that a report has already: learnt on another machine, or in a folder that is gone."""

import gzip
import io
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from er_il.experiments.agents.grid import AgentCell, AgentGrid
from er_il.support.declaration import check_values
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json

if TYPE_CHECKING:
    import pandas as pd


class _Cell(BaseModel):
    """What is read of a cell in ``results.json``."""

    model_config = ConfigDict(extra="ignore", strict=True)

    task: str
    decoder: str
    episodes: int
    per_seed: list[dict[str, Any]]
    curve: dict[str, Any]


class _Meta(BaseModel):
    """What is read of how a report came about."""

    model_config = ConfigDict(extra="ignore", strict=True)

    grid: dict[str, Any]
    settings: dict[str, Any]
    computed_by: list[str]


class _Report(BaseModel):
    """What is read of ``results.json``."""

    model_config = ConfigDict(extra="ignore", strict=True)

    meta: _Meta
    cells: list[_Cell]


@dataclass(frozen=True)
class Published:
    """Cells of a report, which need not be run again."""

    reports: Mapping[AgentCell, dict[str, Any]] = field(default_factory=dict)  # as in ``results.json``
    rollouts: "pd.DataFrame | None" = None  # of these cells, with the columns of ``episodes.csv.gz``

    def of(self, cell: AgentCell) -> "pd.DataFrame":
        """The rollouts of a cell that is published."""
        assert self.rollouts is not None
        return self.rollouts.loc[(self.rollouts["task"] == cell.task) & (self.rollouts["decoder"] == cell.name), :]


def read_published(folder: Path, grid: AgentGrid, settings: Mapping[str, Any]) -> Published:
    """Read the cells of a grid that a report has.

    Those of tasks, seeds or numbers of decisions that the grid does not have any more are left out.

    Args:
        folder: Of the report; nothing is published if it has none.
        grid: What is asked for.
        settings: How its agents learn.

    Raises:
        ErIlError: the report is of agents that learnt with other settings or of another arm, or it is damaged.
    """
    from er_il.evaluation.results import EPISODES, RESULTS  # pandas: a second that mistakes do without

    path = folder / RESULTS
    if not path.exists():
        return Published()
    report = read_json(path, ErIlError)
    check_values(_Report, report, path, ErIlError)
    meta, theirs = report["meta"], AgentGrid.from_dict(report["meta"]["grid"], f"grid in {path}")
    if meta["settings"] != dict(settings) or theirs.arm != grid.arm:
        raise ErIlError(f"{folder} has agents that learnt with other settings, or of another arm: leave --add out.")
    asked = {(cell.task, cell.name): cell for cell in grid.cells if _same(cell, grid, theirs)}
    reports = {
        cell: {"computed_by": meta["computed_by"]} | each
        for each in report["cells"]
        if (cell := asked.get((each["task"], each["decoder"]))) is not None
    }
    found = Published(reports, _read_rollouts(folder / EPISODES))
    for cell, each in reports.items():
        if len(found.of(cell)) != each["episodes"]:
            raise ErIlError(f"{folder / EPISODES} does not hold the episodes of {cell.task} {cell.name} in {path}.")
    return found


def _same(cell: AgentCell, ours: AgentGrid, theirs: AgentGrid) -> bool:
    """True if two grids mean the same by a cell."""
    return (
        ours.tasks[cell.task] == theirs.tasks.get(cell.task)
        and (ours.training_seeds, ours.episodes) == (theirs.training_seeds, theirs.episodes)
        and ours.settings(cell.variant) == theirs.settings(cell.variant)
    )


def _read_rollouts(path: Path) -> "pd.DataFrame":
    import pandas as pd

    try:
        rows = pd.read_csv(io.BytesIO(gzip.decompress(path.read_bytes())), keep_default_na=False)
        return rows.astype({"success": bool})
    except (OSError, EOFError, ValueError, KeyError, zlib.error) as cause:
        raise ErIlError(f"{path} is missing or damaged.") from cause
