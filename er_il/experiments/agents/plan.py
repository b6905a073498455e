"""From a grid of agents to jobs: which files an experiment consists of."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.agents.grid import AgentCell, AgentGrid
from er_il.experiments.agents.jobs import AssessAgent, FilmAgent, TrainAgent
from er_il.experiments.cell_plan import CellPlan
from er_il.experiments.owner import owner_of
from er_il.rl.settings import Settings
from er_il.support.errors import ErIlError


@dataclass(frozen=True)
class AgentPlan(CellPlan[AgentGrid, AgentCell, AssessAgent]):
    """The jobs of agents that learn by reinforcement."""

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
