"""How far a benchmark has come, what it has cost so far, and how long it will still take."""

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

from er_il.evaluation.results import load_cell, load_notes
from er_il.experiments.grid import Entry
from er_il.experiments.jobs import RollOut, Train
from er_il.experiments.plan import Plan
from er_il.experiments.schedule import Job, Schedule


@dataclass
class Score:
    """The rollouts of an entry that are done."""

    total: int
    done: int = 0
    successes: int = 0


@dataclass
class _Pace:
    """Seconds that work took, and how much it was: training steps, rollouts."""

    wall: float = 0.0
    amount: int = 0

    def time(self, amount: int) -> float | None:
        """How long another amount takes [s]; None as long as nothing is known."""
        return amount * self.wall / self.amount if self.amount else (None if amount else 0.0)


@dataclass
class Account:
    """Counts a schedule's finished jobs."""

    plan: Plan
    schedule: Schedule
    scores: dict[Entry, Score] = field(default_factory=dict)
    _seen: set[Job] = field(default_factory=set)
    _training: _Pace = field(default_factory=_Pace)
    _rolling_out: _Pace = field(default_factory=_Pace)

    def __post_init__(self) -> None:
        self._entries = {job: entry for entry, seeds in self.plan.targets.items() for job in _flat(seeds.values())}
        rollouts = self.plan.grid.rollouts
        self.scores = {entry: Score(rollouts * len(seeds)) for entry, seeds in self.plan.targets.items()}
        self.update()

    def update(self) -> list[Entry]:
        """Count what has been done since the last call; return the entries that this completed."""
        new = self.schedule.done - self._seen
        self._seen |= new
        completed = []
        for job in new:
            if isinstance(job, Train):
                self._training.wall += job.read_notes()["cost"]["wall"]
                self._training.amount += job.steps
            elif isinstance(job, RollOut):
                self._rolling_out.wall += load_notes(job.path)["cost"]["wall"]
                self._rolling_out.amount += job.count
                score = self.scores[self._entries[job]]
                score.done += job.count
                score.successes += load_cell(job.path).successes
                if score.done == score.total:
                    completed.append(self._entries[job])
        return completed

    @property
    def completed(self) -> int:
        """Number of entries whose rollouts are all done."""
        return sum(score.done == score.total for score in self.scores.values())

    def remaining(self, workers: int) -> float | None:
        """Estimate the time left [s] from what the work so far took; None as long as nothing is known."""
        pace = self._pace_of_training()
        steps = rollouts = 0
        for job in (*self.schedule.waiting, *self.schedule.running):
            if isinstance(job, Train):
                steps += job.steps - (job.logged_steps if job in self.schedule.running else 0)
            elif isinstance(job, RollOut):
                rollouts += job.count
        training, rolling_out = pace.time(steps), self._rolling_out.time(rollouts)
        return None if training is None or rolling_out is None else (training + rolling_out) / workers

    def _pace_of_training(self) -> _Pace:
        """From finished trainings; from those under way as long as there is none."""
        pace = _Pace(self._training.wall, self._training.amount)
        if not pace.amount:
            for job, start in self.schedule.running.items():
                if isinstance(job, Train) and job.logged_steps:
                    pace.wall += time.monotonic() - start
                    pace.amount += job.logged_steps
        return pace


def _flat(lists: Iterable[list[RollOut]]) -> list[RollOut]:
    return [job for jobs in lists for job in jobs]
