"""A benchmark from its plan to its pages."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.live import Live

from er_il.experiments.account import Account
from er_il.experiments.plan import Plan
from er_il.experiments.report import write_results
from er_il.experiments.schedule import Executor, Schedule
from er_il.experiments.strip import copy_strips, strips
from er_il.experiments.view import View
from er_il.report.grid_page import write_pages


@dataclass(frozen=True)
class Outcome:
    """What a run came to."""

    report: Mapping[str, Any]  # as in results.json
    failures: tuple[str, ...]  # of jobs, which leave cells incomplete
    undrawn: tuple[str, ...]  # why picture strips are missing


def run(plan: Plan, executor: Executor, console: Console, folder: Path) -> Outcome:
    """Do all jobs that are not done yet; write results, figures, picture strips and the page into a folder."""
    schedule = Schedule(plan.jobs)
    view = View(Account(plan, schedule), schedule, executor, console)
    with Live(view, console=console, refresh_per_second=2):
        schedule.run(executor, view.update)
    report = write_results(plan, folder)
    console.print("\nThe results are written; pictures follow.", highlight=False)
    pictures = strips(plan)
    drawing = Schedule(pictures.values())
    drawing.run(executor)
    copy_strips(pictures, folder)
    write_pages(folder)
    return Outcome(report, tuple(schedule.failed.values()), tuple(drawing.failed.values()))
