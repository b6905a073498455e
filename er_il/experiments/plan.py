"""From a grid to jobs: which files an experiment consists of, each named by all that decides what is in it.

So a grid may grow by tasks, decoders, seeds or demonstrations without anything being done again.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, product
from pathlib import Path

import pandas as pd
import yaml

from er_il.datasets.record import DatasetRecord
from er_il.evaluation.posture_baselines import space_of
from er_il.evaluation.results import load_rollouts, long_form
from er_il.evaluation.rollouts import FIRST_SEED
from er_il.experiments.grid import Cell, Grid
from er_il.experiments.jobs import Demonstrate, RollOut, Train
from er_il.policy.actor import POLICY_ROWS
from er_il.policy.configuration import default_config, default_steps
from er_il.support.atomic_files import write_json
from er_il.support.errors import ErIlError
from er_il.support.folder_lock import LOCK, folder_lock

OWNER = "benchmark.json"


@dataclass(frozen=True)
class Plan:
    """A grid's jobs, with their results in a folder that belongs to one grid."""

    grid: Grid
    out: Path
    recorders: int = 1  # processes that record a task's demonstrations

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Make the folder this grid's own, and work in it alone.

        Raises:
            ErIlError: another command works in it, or it holds something else, demonstrations of another recipe
                than today's, or policies trained by another configuration.
        """
        self.out.mkdir(parents=True, exist_ok=True)
        found = {path.name for path in self.out.iterdir()}
        if found - {LOCK} and OWNER not in found:  # left as it is, without a lock
            raise ErIlError(f"{self.out} holds something else than an experiment; choose another --out.")
        with folder_lock(self.out):
            self._claim()
            yield

    def _claim(self) -> None:
        for task, demonstrate in self._demonstrations.items():
            recipe = self.grid.recipe(task)
            for dataset in (demonstrate.path / space for space in demonstrate.spaces):
                if dataset.exists() and (what := recipe.differences(DatasetRecord.read(dataset).recipe)):
                    raise ErIlError(
                        f"{dataset} holds another recipe's demonstrations; asked for is {what}. "
                        f"Choose another --out, or delete what {self.out} holds of {task}."
                    )
        owner = self.out / OWNER
        spaces = sorted({space_of(cell.decoder) for cell in self.grid.cells})
        mine = {name: yaml.safe_load(default_config(name, self.grid.configuration).read_text()) for name in spaces}
        theirs = {}
        if owner.exists():
            found = json.loads(owner.read_text())
            theirs = found["configurations"]
            if found["title"] != self.grid.title:
                raise ErIlError(f"{self.out} belongs to the grid {found['title']!r}; choose another --out.")
            if changed := [name for name in mine if name in theirs and mine[name] != theirs[name]]:
                raise ErIlError(
                    f"{self.out} holds policies trained by other configurations than today's, of "
                    f"{', '.join(changed)}; choose another --out, or delete it."
                )
        write_json(owner, {"title": self.grid.title, "configurations": theirs | mine})

    @cached_property
    def _demonstrations(self) -> dict[str, Demonstrate]:
        spaces = tuple(dict.fromkeys(space_of(cell.decoder) for cell in self.grid.cells))
        folder = self.out / "datasets"
        return {task: Demonstrate(task, self.grid, spaces, folder / task, self.recorders) for task in self.grid.tasks}

    def training(self, cell: Cell, seed: int) -> Train:
        """The training of a cell's policy."""
        space, grid = space_of(cell.decoder), self.grid
        demonstrate = self._demonstrations[cell.task]
        steps = default_steps(default_config(space, grid.configuration)) if grid.steps is None else grid.steps
        return Train(
            task=cell.task,
            space=space,
            dataset=demonstrate.path / space,
            path=self.out / "policies" / cell.task / space / f"{_variant(cell, steps, seed)}.json",
            steps=steps,
            seed=seed,
            demonstrations=cell.demonstrations,
            configuration=grid.configuration,
            needs=(demonstrate,),
        )

    def _rolling_out(self, cell: Cell, seed: int) -> list[RollOut]:
        trained = self.training(cell, seed)
        folder = self.out / "rollouts" / cell.task / cell.decoder / _variant(cell, trained.steps, seed)
        end = FIRST_SEED + self.grid.rollouts
        jobs = []
        for start in range(FIRST_SEED, end, POLICY_ROWS):
            count = min(POLICY_ROWS, end - start)
            jobs.append(RollOut(trained, cell.decoder, start, count, folder / f"{start}-{start + count - 1}.json"))
        return jobs

    @cached_property
    def targets(self) -> dict[Cell, dict[int, list[RollOut]]]:
        """The rollouts of each cell and training seed."""
        return {
            cell: {seed: self._rolling_out(cell, seed) for seed in self.grid.seeds_of(cell)} for cell in self.grid.cells
        }

    @property
    def jobs(self) -> list[RollOut]:
        """All rollouts, the first training seed of every cell first: an early look at the whole table."""
        pairs = product(self.grid.training_seeds, self.grid.cells)
        return [job for seed, cell in pairs for job in self.targets[cell].get(seed, ())]

    @property
    def complete(self) -> list[Cell]:
        """The cells whose rollouts are all done."""
        return [cell for cell, seeds in self.targets.items() if all(job.done for job in chain(*seeds.values()))]

    def rollouts(self, *cells: Cell) -> pd.DataFrame:
        """The rollouts of complete cells in long form (:func:`er_il.evaluation.results.long_form`)."""
        return long_form(
            (vars(cell) | {"training_seed": seed}, load_rollouts(job.path))
            for cell in cells
            for seed, jobs in self.targets[cell].items()
            for job in jobs
        )


def _variant(cell: Cell, steps: int, seed: int) -> str:
    return f"{cell.demonstrations}-demonstrations-{steps}-steps-seed-{seed}"
