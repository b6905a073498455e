"""The experiment with policies that imitate: demonstrations, trainings and rollouts of every cell."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_il.evaluation.results import report_cells
from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.films import films, show
from er_il.experiments.grid import Cell
from er_il.experiments.jobs import Film
from er_il.experiments.plan import Plan
from er_il.report.grid_page import write_pages

if TYPE_CHECKING:
    import pandas as pd

FILMED = ("joint", "erj", "task-nearest", "task-posture")  # as far as the grid has them


@dataclass(frozen=True)
class Imitation:
    """An :class:`er_il.experiments.run.Experiment`."""

    plan: Plan

    def summary(self, cell: Cell) -> str:
        success = self.plan.rollouts(cell)["success"]
        start = "" if cell.within is None else f", within {cell.within:g} m"
        return f"{cell.task} {cell.decoder}, trained on {cell.demonstrations}{start}: {success.sum()}/{len(success)}"

    def results(self) -> "tuple[dict[str, Any], pd.DataFrame, Sequence[str]]":
        rollouts = self.plan.rollouts(*self.plan.complete)
        return {"meta": _meta(self.plan), "cells": report_cells(rollouts)}, rollouts, ()

    def films(self, all_of_them: bool) -> Mapping[str, Sequence[Film]]:
        return films(self.plan, self.plan.grid.decoders if all_of_them else FILMED)

    def show(self, task: str, of_task: Sequence[Film], folder: Path, with_films: bool) -> None:
        show(task, of_task, folder, with_films)

    def write_pages(self, folder: Path) -> None:
        write_pages(folder)


def _meta(plan: Plan) -> dict[str, Any]:
    trained, complete = plan.trained(), plan.complete
    trainings = {job.needs[0] for job in plan.jobs}
    return {
        "title": plan.grid.title,
        "grid": plan.grid.to_dict(),
        "training_steps": dict(sorted({(training.space, training.size) for training in trainings})),
        "mixed_precision": sorted({notes["mixed_precision"] for notes in trained}),
        "rollout_seeds": f"{FIRST_SEED} to {FIRST_SEED + plan.grid.rollouts - 1}",
        "missing": [cell.labels for cell in plan.grid.cells if cell not in complete],
    } | plan.account()
