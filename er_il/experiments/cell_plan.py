"""What the plans of all grids share: a folder to work in, and rollouts of each cell, training seed by training seed."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from er_il.experiments.owner import claimed
from er_il.experiments.schedule import Job
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class TrainingJob(Job):
    """Work whose result are notes (JSON) on something trained."""

    seed: int  # of the training


@dataclass(frozen=True)
class RolloutJob(Job):
    """Work whose result are ``size`` rollouts of what was trained (:func:`er_il.evaluation.results.save_rollouts`)."""

    needs: tuple[TrainingJob]


class LabelledCell(Protocol):
    """What is compared."""

    @property
    def labels(self) -> dict[str, Any]:
        """What results call the cell."""
        ...


class SeededGrid[C: LabelledCell](Protocol):
    """Cells, each to be trained from several seeds."""

    @property
    def cells(self) -> Sequence[C]: ...

    @property
    def training_seeds(self) -> Sequence[int]: ...


@dataclass(frozen=True)
class CellPlan[G: SeededGrid[Any], C: LabelledCell, J: RolloutJob](ABC):
    """A grid's jobs, with their results in a folder. Other grids may share it: what is common is done once."""

    grid: G
    out: Path

    @abstractmethod
    def check(self) -> Mapping[str, Any]:
        """Check that this grid can work in the folder; return what the folder is to say of what it holds.

        Raises:
            ErIlError: it holds something else, or the same made in another way than today's.
        """

    @abstractmethod
    def rollouts_of(self, cell: C) -> Iterable[J]:
        """The rollouts of a cell, training seed by training seed."""

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Make the folder one of experiments, and work in it alone.

        Raises:
            ErIlError: another command works in it, or :meth:`check` refuses it.
        """
        with claimed(self.out, self.check):
            yield

    @cached_property
    def targets(self) -> dict[C, list[J]]:
        """The rollouts of each cell."""
        return {cell: list(self.rollouts_of(cell)) for cell in self.grid.cells}

    @property
    def jobs(self) -> list[J]:
        """All rollouts, the first training seed of every cell first: an early look at the whole table."""
        return sorted(chain(*self.targets.values()), key=lambda job: self.grid.training_seeds.index(job.needs[0].seed))

    @property
    def complete(self) -> list[C]:
        """The cells whose rollouts are all done."""
        return [cell for cell, jobs in self.targets.items() if all(job.done for job in jobs)]

    def rollouts(self, *cells: C) -> "pd.DataFrame":
        """The rollouts of complete cells in long form (:func:`er_il.evaluation.results.long_form`)."""
        from er_il.evaluation.results import load_rollouts, long_form  # pandas: a second that mistakes do without

        return long_form(
            (cell.labels | {"training_seed": job.needs[0].seed}, load_rollouts(job.path))
            for cell in cells
            for job in self.targets[cell]
        )

    def trained(self) -> list[dict[str, Any]]:
        """The notes on each training that is done.

        Raises:
            ErIlError: notes are damaged.
        """
        trainings = {job.needs[0] for job in self.jobs}
        return [read_json(training.path, ErIlError) for training in trainings if training.done]

    def account(self, *cells: C) -> dict[str, Any]:
        """Return as JSON which code computed the results of cells so far, or of all if none is named, and their cost.

        Raises:
            ErIlError: the result of a job is damaged.
        """
        from er_il.evaluation.results import load_notes  # pandas, too

        done = [job for cell in cells or self.targets for job in self.targets[cell] if job.done]
        trained = [read_json(training.path, ErIlError) for training in {job.needs[0] for job in done}]
        rolled_out = [load_notes(job.path) for job in done]
        return {
            "computed_by": sorted({notes["git"] for notes in (*trained, *rolled_out)}),
            "costs": {
                "trainings": len(trained),
                "training_cpu_s": round(sum(notes["cost"]["cpu"] for notes in trained)),
                "rollouts": sum(job.size for job in done),
                "rollout_cpu_s": round(sum(notes["cost"]["cpu"] for notes in rolled_out)),
            },
        }
