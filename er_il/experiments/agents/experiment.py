"""The experiment with agents: their trainings, assessments and curves."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from er_il.evaluation.aggregate import interquartile_mean, stratified_interval
from er_il.evaluation.recording import SUCCESS
from er_il.evaluation.results import COUNTS, difference_to_reference, report_cells
from er_il.evaluation.rollout import FIRST_SEED
from er_il.evaluation.trace import Trace
from er_il.experiments.agents.grid import AgentCell
from er_il.experiments.agents.jobs import FilmAgent
from er_il.experiments.agents.plan import AgentPlan
from er_il.experiments.films import PICTURES, STRIP
from er_il.report.agents_page import write_pages
from er_il.report.films import Panel, write_strip
from er_il.report.style import label_of
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json

if TYPE_CHECKING:
    import pandas as pd

CELL = ("task", "decoder")
COSTS = ("trainings", "training_cpu_s", "rollouts", "rollout_cpu_s")


@dataclass(frozen=True)
class Learning:
    """An :class:`er_il.experiments.run.Experiment`."""

    plan: AgentPlan

    def summary(self, cell: AgentCell) -> str:
        success = self.plan.rollouts(cell).groupby("training_seed")["success"].sum()
        return f"{cell.task} {cell.name}: {', '.join(map(str, success))} of {self.plan.grid.episodes}"

    def results(self) -> "tuple[dict[str, Any], pd.DataFrame, Sequence[str]]":
        import pandas as pd

        plan, complete = self.plan, self.plan.complete
        kept = [cell for cell in plan.published.reports if cell not in complete]
        rollouts = {cell: plan.published.of(cell) for cell in kept} | {cell: plan.rollouts(cell) for cell in complete}
        rollouts = {cell: rollouts[cell] for cell in plan.grid.cells if cell in rollouts}
        everything = pd.concat(rollouts.values()) if rollouts else plan.rollouts()
        cells = []
        for cell, of_cell in rollouts.items():
            if cell in complete:
                [report] = report_cells(of_cell, CELL)
                report |= {"mode": cell.mode, "variant": cell.variant, "curve": self._curve(cell)} | plan.account(cell)
            else:
                report = plan.published.reports[cell]
            cells.append(report | difference_to_reference(of_cell, CELL, everything))
        report = {"meta": self._meta(cells), "cells": cells, "suite": _suite(cells, list(plan.grid.tasks))}
        return report, everything, [*CELL, "training_seed", *COUNTS]

    def films(self, all_of_them: bool) -> Mapping[str, Sequence[FilmAgent]]:
        return self.plan.films()

    def show(self, task: str, of_task: Sequence[FilmAgent], folder: Path, with_films: bool) -> None:
        panels = []
        for film, cell in zip(of_task, (cell for cell in self.plan.grid.cells if cell.task == task), strict=True):
            outcome = Trace.load(film.path).outcome
            panels.append(Panel(label_of(cell.name), outcome.replace("_", " "), outcome == SUCCESS, film.film))
        write_strip(panels, PICTURES, folder / STRIP.format(task))

    def write_pages(self, folder: Path) -> None:
        write_pages(folder)

    def _curve(self, cell: AgentCell) -> dict[str, Any]:
        """Success and invalid actions over the decisions learnt from, seed by seed."""
        notes = [read_json(job.needs[0].path, ErIlError)["milestones"] for job in self.plan.targets[cell]]
        return {
            "steps": [each["steps"] for each in notes[0]],
            "episodes": notes[0][0]["episodes"],
            "successes": [[each["successes"] for each in of_seed] for of_seed in notes],
            "invalid_rates": [[each["invalid_rate"] for each in of_seed] for of_seed in notes],
        }

    def _meta(self, cells: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        plan, found = self.plan, {(cell["task"], cell["decoder"]) for cell in cells}
        costs = [cell["costs"] for cell in cells if "costs" in cell]  # reports before version 0.3 have none of a cell
        return {
            "title": plan.grid.title,
            "grid": plan.grid.to_dict(),
            "settings": plan.settings.to_dict(),
            "rollout_seeds": f"{FIRST_SEED} to {FIRST_SEED + plan.grid.episodes - 1}",
            "computed_by": sorted({code for cell in cells for code in cell["computed_by"]}),
            "costs": {name: sum(each[name] for each in costs) for name in COSTS},
            "missing": [cell.labels for cell in plan.grid.cells if (cell.task, cell.name) not in found],
        }


def _suite(cells: Sequence[Mapping[str, Any]], tasks: Sequence[str]) -> list[dict[str, Any]]:
    """Aggregates over all tasks, of the modes that are complete on each."""
    suite = []
    for name in dict.fromkeys(cell["decoder"] for cell in cells):
        own = {cell["task"]: cell["per_seed"] for cell in cells if cell["decoder"] == name}
        if set(own) != set(tasks):
            continue
        scores = np.array([[seed["successes"] / seed["episodes"] for seed in own[task]] for task in tasks]).T
        low, high = stratified_interval(scores)
        suite.append({"decoder": name, "iqm": interquartile_mean(scores), "interval": [low, high]})
    return suite
