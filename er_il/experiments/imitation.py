"""The experiment with policies that imitate: demonstrations, trainings and rollouts of every cell."""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_il.evaluation.results import load_notes, report_cells
from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.films import films, show
from er_il.experiments.grid import Cell
from er_il.experiments.jobs import Film, RollOut
from er_il.experiments.plan import Plan
from er_il.report.grid_page import write_pages
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json

if TYPE_CHECKING:
    import pandas as pd

FILMED = ("joint", "erj", "task-nearest", "task-posture")  # as far as the grid has them


@dataclass(frozen=True)
class Imitation:
    """An :class:`er_il.experiments.run.Experiment`."""

    plan: Plan

    @property
    def out(self) -> Path:
        return self.plan.out

    @property
    def jobs(self) -> Sequence[RollOut]:
        return self.plan.jobs

    @property
    def targets(self) -> Mapping[Cell, Sequence[RollOut]]:
        return self.plan.targets

    def check(self) -> object:
        return self.plan.check()

    def claimed(self) -> AbstractContextManager[None]:
        return self.plan.claimed()

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
    grid, complete = plan.grid, plan.complete
    trainings = {plan.training(cell, seed) for cell in grid.cells for seed in grid.training_seeds}
    trained = [read_json(training.path, ErIlError) for training in trainings if training.done]
    rollouts = [job for job in plan.jobs if job.done]
    rolled_out = [load_notes(job.path) for job in rollouts]
    return {
        "title": grid.title,
        "grid": grid.to_dict(),
        "computed_by": sorted({notes["git"] for notes in (*trained, *rolled_out)}),
        "training_steps": dict(sorted({(training.space, training.size) for training in trainings})),
        "mixed_precision": sorted({notes["mixed_precision"] for notes in trained}),
        "rollout_seeds": f"{FIRST_SEED} to {FIRST_SEED + grid.rollouts - 1}",
        "costs": {
            "trainings": len(trained),
            "training_cpu_s": round(sum(notes["cost"]["cpu"] for notes in trained)),
            "rollouts": sum(job.size for job in rollouts),
            "rollout_cpu_s": round(sum(notes["cost"]["cpu"] for notes in rolled_out)),
        },
        "missing": [cell.labels for cell in grid.cells if cell not in complete],
    }
