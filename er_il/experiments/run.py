"""An experiment from its plan to its results: a report as JSON, every rollout as a row of a CSV, pictures, pages."""

import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from rich.progress import Progress

from er_il.evaluation.results import EPISODES, RESULTS, as_csv, load_notes, report_cells
from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.films import films, show
from er_il.experiments.plan import Plan
from er_il.experiments.schedule import Executor, Schedule
from er_il.report.grid_page import write_pages
from er_il.support.atomic_files import write_atomically, write_json
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json
from er_il.support.provenance import provenance

FILMED = ("joint", "erj", "task-nearest", "task-posture")  # as far as the grid has them


@dataclass(frozen=True)
class Outcome:
    """Results of a run."""

    report: Mapping[str, Any]  # as in results.json
    failures: tuple[str, ...]  # of jobs, which leave cells incomplete
    unfilmed: tuple[str, ...]  # why films and pictures are missing


def run(plan: Plan, executor: Executor, progress: Progress, folder: Path, with_films: bool = False) -> Outcome:
    """Do all jobs that are not done yet; write results, figures, pictures and the page into a folder.

    Args:
        plan: What to do.
        executor: Where the jobs run.
        progress: Where to show progress.
        folder: Where the results go.
        with_films: Film every decoder of the grid, and put the films and the recordings among the results, not only
            a strip of pictures through some decoders.

    Raises:
        ErIlError: the plan's folder belongs to something else, or another command works in it.
    """
    with plan.claimed():
        schedule = Schedule(plan.jobs)
        _run(schedule, executor, progress, _announcing(plan, schedule, progress))
        report = write_results(plan, folder)
        filming = films(plan, plan.grid.decoders if with_films else FILMED)
        recording = Schedule(chain(*filming.values()))
        _run(recording, executor, progress)
        for task, of_task in filming.items():
            if recording.done.issuperset(of_task):
                show(task, of_task, folder, with_films)
        write_pages(folder)
    return Outcome(report, tuple(schedule.failed.values()), tuple(recording.failed.values()))


def _run(schedule: Schedule, executor: Executor, progress: Progress, watch: Callable[[], None] = lambda: None) -> None:
    """Run a schedule, with a progress bar for each stage that has something to do."""
    stages = dict.fromkeys(job.stage for job in schedule.jobs if job not in schedule.done)
    jobs = {stage: [job for job in schedule.jobs if job.stage == stage] for stage in stages}
    bars = {stage: progress.add_task(stage, total=sum(job.size for job in jobs[stage])) for stage in stages}

    def update() -> None:
        for stage, bar in bars.items():
            progress.update(bar, completed=sum(map(schedule.progress, jobs[stage])))
        watch()

    schedule.run(executor, update)


def _announcing(plan: Plan, schedule: Schedule, progress: Progress) -> Callable[[], None]:
    """A function that prints the successes of the cells that are complete since its last call, for logs too."""
    total, waiting = len(plan.targets), dict(plan.targets)

    def announce() -> None:
        for cell in [cell for cell, jobs in waiting.items() if schedule.done.issuperset(jobs)]:
            del waiting[cell]
            success = plan.rollouts(cell)["success"]
            start = "" if cell.within is None else f", within {cell.within:g} m"
            text = (
                f"{cell.task} {cell.decoder}, trained on {cell.demonstrations}{start}: {success.sum()}/{len(success)}"
            )
            text += f" ({total - len(waiting)}/{total} cells)"
            progress.console.print(text, highlight=False, soft_wrap=True)

    return announce


def write_results(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write ``results.json`` and ``episodes.csv.gz`` of all complete cells; return the former."""
    rollouts = plan.rollouts(*plan.complete)
    report = {"meta": provenance() | _meta(plan), "cells": report_cells(rollouts)}
    write_json(folder / RESULTS, report)
    # The same bytes for the same rollouts: neither a name nor a time goes into the header.
    compressed = gzip.compress(as_csv(rollouts).encode(), mtime=0)
    write_atomically(folder / EPISODES, lambda path: path.write_bytes(compressed))
    return report


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
