"""An experiment from its plan to its pages."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from rich.progress import Progress

from er_il.experiments.films import films, show_films, show_strip
from er_il.experiments.plan import Plan
from er_il.experiments.results import write_results
from er_il.experiments.schedule import Executor, Job, Schedule
from er_il.report.grid_page import write_pages

FILMED = ("joint", "erj", "task-nearest", "task-posture")  # as far as the grid has them


@dataclass(frozen=True)
class Outcome:
    """Results of a run."""

    report: Mapping[str, Any]  # as in results.json
    failures: tuple[str, ...]  # of jobs, which leave cells incomplete
    unfilmed: tuple[str, ...]  # why films and pictures are missing


def run(
    plan: Plan,
    executor: Executor,
    progress: Progress,
    folder: Path,
    filmed: Sequence[str] = FILMED,
    with_films: bool = False,
) -> Outcome:
    """Do all jobs that are not done yet; write results, figures, pictures and the page into a folder.

    Args:
        plan: What to do.
        executor: Where the jobs run.
        progress: Where to show progress.
        folder: Where the results go.
        filmed: Decoders to film on one initial state of each task.
        with_films: Put the films and the recordings among the results, not only a strip of pictures.

    Raises:
        ErIlError: the plan's folder belongs to something else, or another command works in it.
    """
    with plan.claimed():
        schedule = Schedule(plan.jobs)
        _run(schedule, executor, progress, _announcing(plan, schedule, progress))
        report = write_results(plan, folder)
        filming = films(plan, filmed)
        recording = Schedule(chain.from_iterable(filming.values()))
        _run(recording, executor, progress)
        for of_task in filming.values():
            if all(film.done for film in of_task):
                show_strip(of_task, folder)
                if with_films:
                    show_films(of_task, folder)
        write_pages(folder)
    return Outcome(report, tuple(schedule.failed.values()), tuple(recording.failed.values()))


def _run(
    schedule: Schedule, executor: Executor, progress: Progress, announce: Callable[[], None] = lambda: None
) -> None:
    """Run a schedule, with a progress bar for each stage."""
    stages: dict[str, list[Job]] = {job.stage: [] for job in schedule.jobs if job not in schedule.done}
    for job in schedule.jobs:
        if job.stage in stages:
            stages[job.stage].append(job)
    bars = {name: progress.add_task(name, total=sum(job.size for job in jobs)) for name, jobs in stages.items()}

    def completed(job: Job) -> int:
        return job.size if job in schedule.done else job.progress if job in schedule.running else 0

    def watch() -> None:
        for name, jobs in stages.items():
            progress.update(bars[name], completed=sum(map(completed, jobs)))
        announce()

    schedule.run(executor, watch)


def _announcing(plan: Plan, schedule: Schedule, progress: Progress) -> Callable[[], None]:
    """A function that prints the successes of the cells that are complete since its last call, for logs too."""
    jobs = {cell: set(chain.from_iterable(seeds.values())) for cell, seeds in plan.targets.items()}
    total = len(jobs)

    def announce() -> None:
        for cell in [cell for cell, its in jobs.items() if its <= schedule.done]:
            del jobs[cell]
            success = plan.rollouts(cell)["success"]
            progress.console.print(
                f"{cell.task} {cell.decoder}, trained on {cell.demonstrations}: {success.sum()}/{len(success)} "
                f"({total - len(jobs)}/{total} cells)",
                highlight=False,
                soft_wrap=True,
            )

    return announce
