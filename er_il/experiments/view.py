"""A benchmark while it runs: a table of rollouts, what is under way, and how long it will take."""

import time
from dataclasses import dataclass, field

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from er_il.experiments.account import Account, Score
from er_il.experiments.grid import Entry
from er_il.experiments.jobs import Train
from er_il.experiments.schedule import Executor, Schedule

SHOWN = 12  # running jobs; a cluster has more than a screen has lines


@dataclass
class View:
    """Renders the state of a schedule, for :class:`rich.live.Live`."""

    account: Account
    schedule: Schedule
    executor: Executor
    console: Console
    started: float = field(default_factory=time.monotonic)  # [s]

    def update(self) -> None:
        """Count what is new; say which cells are complete, for logs too."""
        for entry in self.account.update():
            score = self.account.scores[entry]
            count = f", trained on {entry.demonstrations}" * self._several
            self.console.print(
                f"{entry.task} {entry.decoder}{count}: {score.successes}/{score.total} ({self._state()})",
                highlight=False,
                soft_wrap=True,
            )

    def __rich__(self) -> RenderableType:
        table = Table(box=None, header_style="bold")
        grid = self.account.plan.grid
        names = (*grid.decoders, *grid.sceptics)
        for heading in ("Task", *["Demos"] * self._several):
            table.add_column(heading)
        for name in names:
            table.add_column(name, justify="right")
        for task in grid.tasks:
            for count in grid.demonstrations:
                scores = [self.account.scores[Entry(task, name, count)] for name in names]
                table.add_row(task, *[str(count)] * self._several, *map(_shown, scores))
        running = [Text(f"  {_described(job, start)}") for job, start in list(self.schedule.running.items())[:SHOWN]]
        failed = [Text(f"  failed: {message}", style="red") for message in self.schedule.failed.values()]
        return Group(table, *running, *failed, Text(self._state(), style="bold"))

    @property
    def _several(self) -> bool:
        return len(self.account.plan.grid.demonstrations) > 1

    def _state(self) -> str:
        remaining = self.account.remaining(self.executor.workers)
        left = "" if remaining is None or not self.schedule.running else f", about {_clock(remaining)} left"
        total = len(self.account.scores)
        return f"{self.account.completed}/{total} cells, {_clock(time.monotonic() - self.started)}{left}"


def _shown(score: Score) -> Text:
    if not score.done:
        return Text("–", style="dim")
    text = f"{score.successes}/{score.done}"
    return Text(text) if score.done == score.total else Text(f"{text} of {score.total}", style="dim")


def _described(job: object, start: float) -> str:
    steps = f", step {job.logged_steps}/{job.steps}" if isinstance(job, Train) else ""
    return f"{getattr(job, 'name', job)}{steps}, {_clock(time.monotonic() - start)}"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}"
