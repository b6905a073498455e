"""From a grid to jobs: which files a benchmark consists of, each named by all that decides what is in it.

So a grid may grow by tasks, decoders, seeds or demonstrations without anything being done again.
"""

import json
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import yaml
from rich.progress import Progress

from er_il.datasets.record import DatasetRecord
from er_il.datasets.recording import generate
from er_il.evaluation.posture_baselines import space_of
from er_il.evaluation.results import load_cell
from er_il.evaluation.rollouts import Cell
from er_il.experiments.grid import Entry, Grid
from er_il.experiments.jobs import RollOut, Train, roll_outs, steps_of
from er_il.policy.configuration import default_config
from er_il.support.atomic_files import write_atomically
from er_il.support.errors import ErIlError

OWNER = "benchmark.json"


@dataclass(frozen=True)
class Demonstrate:
    """Record the demonstrations of a grid's task, once, and encode them in each space."""

    task: str
    grid: Grid
    spaces: tuple[str, ...]
    out: Path  # folder of the datasets, one a space

    needs = ()

    @property
    def name(self) -> str:
        """What it does, for people."""
        return f"demonstrate {self.task}"

    @property
    def log(self) -> Path:
        """What went wrong, if something did."""
        return self.out.with_name(f"{self.out.name}.log")

    @property
    def done(self) -> bool:
        """Whether every dataset is there."""
        return all((self.out / space).exists() for space in self.spaces)

    def run(self) -> None:
        """Record and encode what is missing."""
        with Progress(disable=True) as progress:
            generate(self.grid.recipe(self.task), self.spaces, self.out, progress, workers=1)


@dataclass(frozen=True)
class Plan:
    """A grid's jobs, with their results in a folder that belongs to one grid."""

    grid: Grid
    out: Path

    def claim(self) -> None:
        """Make the folder this grid's own.

        Raises:
            ErIlError: it holds something else, demonstrations of another recipe than today's, or policies
                trained by another configuration.
        """
        for task, demonstrate in self._demonstrations.items():
            for dataset in (demonstrate.out / space for space in demonstrate.spaces):
                if dataset.exists() and (
                    what := self.grid.recipe(task).differences(DatasetRecord.read(dataset).recipe)
                ):
                    raise ErIlError(
                        f"{dataset} holds another recipe's demonstrations; asked for is {what}. "
                        f"Choose another --out, or delete what {self.out} holds of {task}."
                    )
        owner = self.out / OWNER
        names = {space_of(entry.decoder) for entry in self.grid.entries}
        mine = {
            name: yaml.safe_load(default_config(name, self.grid.configuration).read_text()) for name in sorted(names)
        }
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
        elif self.out.exists() and any(self.out.iterdir()):
            raise ErIlError(f"{self.out} holds something else than a benchmark; choose another --out.")
        self.out.mkdir(parents=True, exist_ok=True)
        claim = json.dumps({"title": self.grid.title, "configurations": theirs | mine}, indent=2)
        write_atomically(owner, lambda path: path.write_text(claim))

    @cached_property
    def _demonstrations(self) -> dict[str, Demonstrate]:
        spaces = tuple(dict.fromkeys(space_of(entry.decoder) for entry in self.grid.entries))
        folder = self.out / "datasets"
        return {task: Demonstrate(task, self.grid, spaces, folder / task) for task in self.grid.tasks}

    def training(self, entry: Entry, seed: int) -> Train:
        """The training of an entry's policy."""
        space = space_of(entry.decoder)
        demonstrate = self._demonstrations[entry.task]
        steps = steps_of(space, self.grid.steps, self.grid.configuration)
        return Train(
            task=entry.task,
            space=space,
            dataset=demonstrate.out / space,
            out=self.out / "policies" / entry.task / space / _variant(entry, seed, steps),
            steps=steps,
            seed=seed,
            demonstrations=entry.demonstrations,
            configuration=self.grid.configuration,
            needs=(demonstrate,),
        )

    def rolling_out(self, entry: Entry, seed: int) -> list[RollOut]:
        """The rollouts of an entry's policy with one training seed."""
        trained = self.training(entry, seed)
        folder = self.out / "rollouts" / entry.task / entry.decoder / _variant(entry, seed, trained.steps)
        return roll_outs(trained, entry.decoder, self.grid.rollouts, folder)

    @cached_property
    def targets(self) -> dict[Entry, dict[int, list[RollOut]]]:
        """The rollouts of each entry and training seed."""
        return {
            entry: {seed: self.rolling_out(entry, seed) for seed in self.grid.seeds_of(entry)}
            for entry in self.grid.entries
        }

    @property
    def jobs(self) -> list[RollOut]:
        """All rollouts, the first training seed of every entry first: an early look at the whole table."""
        pairs = product(self.grid.training_seeds, self.grid.entries)
        return [job for seed, entry in pairs for job in self.targets[entry].get(seed, ())]

    def results(self, entry: Entry) -> dict[int, Cell] | None:
        """The rollouts of an entry by training seed; None as long as one is missing."""
        parts = self.targets[entry]
        if not all(job.done for jobs in parts.values() for job in jobs):
            return None
        return {seed: Cell.joined([load_cell(job.path) for job in jobs]) for seed, jobs in parts.items()}


def _variant(entry: Entry, seed: int, steps: int) -> str:
    return f"{entry.demonstrations}-demonstrations-{steps}-steps-seed-{seed}"
