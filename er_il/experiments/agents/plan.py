"""From a grid of agents to jobs: which files an experiment consists of."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.agents.grid import AgentCell, AgentGrid
from er_il.experiments.agents.jobs import AssessAgent, FilmAgent, TrainAgent
from er_il.experiments.agents.published import Published, read_published
from er_il.experiments.cell_plan import CellPlan
from er_il.experiments.owner import owner_of
from er_il.rl.settings import Settings
from er_il.support.errors import ErIlError


@dataclass(frozen=True)
class AgentPlan(CellPlan[AgentGrid, AgentCell, AssessAgent]):
    """The jobs of agents that learn by reinforcement, but for cells that are published unless the folder has them."""

    published: Published = field(default_factory=Published, hash=False)

    def beside(self, folder: Path) -> Self:
        """This plan without the cells that a report has.

        Raises:
            ErIlError: the report is damaged, or of agents that learnt otherwise.
        """
        return replace(self, published=read_published(folder, self.grid, self.settings.to_dict()))

    @cached_property
    def settings(self) -> Settings:
        """How all agents learn."""
        return Settings.shipped(pixels=False)

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

    def rollouts_of(self, cell: AgentCell) -> Iterator[AssessAgent]:
        """The assessments of a cell, training seed by training seed."""
        for training in (self.training(cell, seed) for seed in self.grid.training_seeds):
            path = training.path.with_name(f"{training.path.stem}-{self.grid.episodes}-episodes.json")
            yield AssessAgent(path, f"assess {training.name}", (training,), self.grid.episodes)

    @cached_property
    def targets(self) -> dict[AgentCell, list[AssessAgent]]:
        """The assessments of each cell that this folder has, or is to have."""
        jobs = {cell: list(self.rollouts_of(cell)) for cell in self.grid.cells}
        known = self.published.reports
        return {cell: of_cell for cell, of_cell in jobs.items() if cell not in known or all(j.done for j in of_cell)}

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
