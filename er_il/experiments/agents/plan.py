"""From a grid of agents to jobs: which files an experiment consists of."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.agents.grid import AgentCell, AgentGrid
from er_il.experiments.agents.jobs import AssessAgent, FilmAgent, TrainAgent
from er_il.experiments.owner import claimed, owner_of
from er_il.rl.settings import Settings
from er_il.support.errors import ErIlError

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class AgentPlan:
    """A grid's jobs, with their results in a folder. Other grids may share it: what is common is done once."""

    grid: AgentGrid
    out: Path

    @cached_property
    def settings(self) -> Settings:
        """How all agents learn."""
        return Settings.shipped(pixels=False)

    @contextmanager
    def claimed(self) -> Iterator[None]:
        """Work in the folder alone.

        Raises:
            ErIlError: another command works in it, or :meth:`check` refuses it.
        """
        with claimed(self.out, self.check):
            yield

    def check(self) -> dict[str, Any]:
        """Check that this grid can work in the folder; return what the folder is to say of its agents.

        Raises:
            ErIlError: it holds something else, or agents that learnt otherwise.
        """
        mine = {"settings": self.settings.to_dict(), "arm": self.grid.arm}
        found = owner_of(self.out)
        if found is not None and any(found.get(key) != value for key, value in mine.items()):
            raise ErIlError(
                f"{self.out} holds agents that learnt with other settings than today's; choose another --out."
            )
        variants = (found or {}).get("variants", {})
        ours = {name: dict(settings) for name, settings in self.grid.variants.items()}
        if changed := [name for name in ours if name in variants and variants[name] != ours[name]]:
            raise ErIlError(f"{self.out} holds other variants named {', '.join(changed)}; choose another --out.")
        return mine | {"variants": variants | ours}

    def training(self, cell: AgentCell, seed: int) -> TrainAgent:
        """The training of a cell's agent."""
        steps = self.grid.tasks[cell.task]
        folder = self.out / "agents" / cell.task / "-".join(filter(None, (cell.mode, cell.variant)))
        return TrainAgent(
            folder / f"{steps}-steps-seed-{seed}.json",
            f"learn {cell.task} in {cell.name}, seed {seed}",
            (),
            size=steps,
            task=cell.task,
            mode=cell.mode,
            seed=seed,
            arm=self.grid.arm,
            environment=self.grid.settings(cell.variant),
            settings=self.settings,
        )

    def _assessment(self, training: TrainAgent) -> AssessAgent:
        path = training.path.with_name(f"{training.path.stem}-{self.grid.episodes}-episodes.json")
        return AssessAgent(path, f"assess {training.name}", (training,), self.grid.episodes)

    @cached_property
    def targets(self) -> dict[AgentCell, list[AssessAgent]]:
        """The assessments of each cell, training seed by training seed."""
        seeds = self.grid.training_seeds
        return {cell: [self._assessment(self.training(cell, seed)) for seed in seeds] for cell in self.grid.cells}

    @property
    def jobs(self) -> list[AssessAgent]:
        """All assessments, the first training seed of every cell first: an early look at the whole grid."""
        return sorted(chain(*self.targets.values()), key=lambda job: self.grid.training_seeds.index(job.needs[0].seed))

    @property
    def complete(self) -> list[AgentCell]:
        """The cells whose assessments are all done."""
        return [cell for cell, jobs in self.targets.items() if all(job.done for job in jobs)]

    def rollouts(self, *cells: AgentCell) -> "pd.DataFrame":
        """The episodes of complete cells in long form (:func:`er_il.evaluation.results.long_form`)."""
        from er_il.evaluation.results import load_rollouts, long_form  # pandas: a second that mistakes do without

        return long_form(
            ({"task": cell.task, "decoder": cell.name, "training_seed": job.needs[0].seed}, load_rollouts(job.path))
            for cell in cells
            for job in self.targets[cell]
        )

    def films(self) -> dict[str, list[FilmAgent]]:
        """Of each task whose cells are complete, the first start through every mode, by the first seed's agents."""
        complete, seed, found = set(self.complete), self.grid.training_seeds[0], {}
        for task in self.grid.tasks:
            cells = [cell for cell in self.grid.cells if cell.task == task]
            if complete.issuperset(cells):
                found[task] = [self._film(self.training(cell, seed)) for cell in cells]
        return found

    def _film(self, training: TrainAgent) -> FilmAgent:
        path = training.path.with_name(f"{training.path.stem}-start-{FIRST_SEED}.npz")
        return FilmAgent(path, f"film {training.name}", (training,), 1, FIRST_SEED)
