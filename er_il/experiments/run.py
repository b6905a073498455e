"""An experiment from its plan to its results: a report as JSON, every rollout as a row of a CSV, pictures, pages."""

import gzip
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rich.progress import Progress

from er_il.evaluation.results import EPISODES, RESULTS, as_csv
from er_il.experiments.cell_plan import CellPlan
from er_il.experiments.schedule import Executor, Job, Schedule
from er_il.support.atomic_files import write_atomically, write_json
from er_il.support.errors import ErIlError
from er_il.support.provenance import provenance

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Outcome:
    """Results of a run."""

    report: Mapping[str, Any]  # as in results.json
    failures: tuple[str, ...]  # of jobs, which leave cells incomplete
    unfilmed: tuple[str, ...]  # why films and pictures are missing


class Experiment(Protocol):
    """What a kind of experiment consists of, and how it is shown."""

    @property
    def plan(self) -> CellPlan[Any, Any, Any]:
        """All that its results need."""
        ...

    def summary(self, cell: Any) -> str:
        """A complete cell in a line."""
        ...

    def results(self) -> "tuple[dict[str, Any], pd.DataFrame, Sequence[str]]":
        """The report of the complete cells, their rollouts in long form, and which columns to publish; all if empty."""
        ...

    def films(self, all_of_them: bool) -> Mapping[str, Sequence[Job]]:
        """The films of each task that is complete: a telling choice, or all."""
        ...

    def show(self, task: str, of_task: Sequence[Any], folder: Path, with_films: bool) -> None:
        """Put pictures of a task's films among the results, and the films themselves if wanted."""
        ...

    def write_pages(self, folder: Path) -> None:
        """Write figures and pages from the results."""
        ...


def run(
    experiment: Experiment, executor: Executor, progress: Progress, folder: Path, with_films: bool = False
) -> Outcome:
    """Do all jobs that are not done yet; write results, figures, pictures and the page into a folder.

    Args:
        experiment: What to do.
        executor: Where the jobs run.
        progress: Where to show progress.
        folder: Where the results go.
        with_films: Film all that the grid compares, and put the films and the recordings among the results, not only
            a strip of pictures of some.

    Raises:
        ErIlError: the experiment's folder belongs to something else, or another command works in it.
    """
    with experiment.plan.claimed():
        schedule = Schedule(experiment.plan.jobs)
        _run(schedule, executor, progress, _announcing(experiment, schedule, progress))
        report = write_results(experiment, folder)
        filming = experiment.films(with_films)
        recording = Schedule(chain(*filming.values()))
        _run(recording, executor, progress)
        _show(experiment, filming, folder, with_films)
    return Outcome(report, tuple(schedule.failed.values()), tuple(recording.failed.values()))


def report_complete(experiment: Experiment, folder: Path) -> Outcome:
    """Write what :func:`run` writes, of the cells that are complete by now; another command may be at work on others.

    Raises:
        ErIlError: no cell is complete.
    """
    plan = experiment.plan
    if not plan.complete:
        raise ErIlError(f"None of the {len(plan.targets)} cells is complete in {plan.out}.")
    report = write_results(experiment, folder)
    _show(experiment, experiment.films(False), folder, with_films=False)
    return Outcome(report, (), ())


def _show(experiment: Experiment, filming: Mapping[str, Sequence[Job]], folder: Path, with_films: bool) -> None:
    """Show the tasks that are filmed, and write the page."""
    for task, of_task in filming.items():
        if all(job.done for job in of_task):
            experiment.show(task, of_task, folder, with_films)
    experiment.write_pages(folder)


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


def _announcing(experiment: Experiment, schedule: Schedule, progress: Progress) -> Callable[[], None]:
    """A function that prints the successes of the cells that are complete since its last call, for logs too."""
    total, waiting = len(experiment.plan.targets), dict(experiment.plan.targets)

    def announce() -> None:
        for cell in [cell for cell, jobs in waiting.items() if schedule.done.issuperset(jobs)]:
            del waiting[cell]
            text = f"{experiment.summary(cell)} ({total - len(waiting)}/{total} cells)"
            progress.console.print(text, highlight=False, soft_wrap=True)

    return announce


def write_results(experiment: Experiment, folder: Path) -> dict[str, Any]:
    """Write ``results.json`` and ``episodes.csv.gz`` of all complete cells; return the former."""
    report, rollouts, columns = experiment.results()
    report["meta"] = provenance() | report["meta"]
    write_json(folder / RESULTS, report)
    # The same bytes for the same rollouts: neither a name nor a time goes into the header.
    compressed = gzip.compress(as_csv(rollouts, columns).encode(), mtime=0)
    write_atomically(folder / EPISODES, lambda path: path.write_bytes(compressed))
    return report
