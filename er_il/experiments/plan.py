"""From a grid to jobs: which files an experiment consists of, each named by all that decides what is in it.

So a grid may grow by tasks, decoders, seeds or demonstrations without anything being done again.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from er_il.datasets.record import DatasetRecord
from er_il.evaluation.posture_baselines import space_of
from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.cell_plan import CellPlan
from er_il.experiments.grid import Cell, Grid
from er_il.experiments.jobs import Demonstrate, DeriveDataset, FitWeights, HideJoints, RollOut, Train
from er_il.experiments.owner import OWNER, owner_of
from er_il.policy.configuration import default_config, default_steps, read_config
from er_il.policy.rows import POLICY_ROWS
from er_il.spaces.chunk import commands_of
from er_il.spaces.joint import JOINT
from er_il.spaces.registry import ERX
from er_il.support.errors import ErIlError


@dataclass(frozen=True)
class Plan(CellPlan[Grid, Cell, RollOut]):
    """The jobs of policies that imitate demonstrations."""

    recorders: int = 1  # processes that record a task's demonstrations

    def check(self) -> dict[str, Any]:
        """Check that this grid can work in the folder; return what the folder is to say of its policies.

        Raises:
            ErIlError: it holds something else, demonstrations of another recipe than today's, or policies trained by
                another configuration.
        """
        owned, grid = owner_of(self.out), self.grid
        for cell in grid.cells:
            source = self._source(cell)
            dataset = source.dataset(space_of(cell.decoder))
            if dataset.exists() and (what := source.recipe.differences(DatasetRecord.read(dataset).recipe)):
                raise ErIlError(
                    f"{dataset} holds another recipe's demonstrations; asked for is {what}. "
                    f"Choose another --out, or delete what {self.out} holds of {cell.task}."
                )
        mine = {name: read_config(default_config(name, grid.configuration)) for name in grid.spaces}
        theirs = {} if owned is None else owned.get("configurations")
        if not isinstance(theirs, dict):
            raise ErIlError(f"{self.out / OWNER} is damaged: it does not say how the folder's policies were trained.")
        if changed := [name for name in mine if name in theirs and mine[name] != theirs[name]]:
            raise ErIlError(
                f"{self.out} holds policies trained by other configurations than today's, of "
                f"{', '.join(changed)}; choose another --out, or delete it."
            )
        return {"configurations": theirs | mine}

    @cached_property
    def _demonstrations(self) -> dict[str, Demonstrate]:
        # Weights of ERX belong to the demonstrations that a policy sees: see _source.
        spaces = tuple(space for space in self.grid.spaces if commands_of(space) != ERX) or (JOINT,)
        folder, jobs = self.out / "datasets", {}
        for task in self.grid.tasks:
            recipe, name = self.grid.recipe(task), f"demonstrate {task}"
            jobs[task] = Demonstrate(folder / task, name, (), recipe.episodes, recipe, spaces, self.recorders)
        return jobs

    def _source(self, cell: Cell) -> Demonstrate | DeriveDataset:
        """What makes the dataset of a cell's policy."""
        demonstrated, space = self._demonstrations[cell.task], space_of(cell.decoder)
        source, name = demonstrated, space
        if commands_of(space) == ERX:
            count = cell.demonstrations
            name = f"{space}-{count}-demonstrations"
            fit = f"fit {space} to {count} demonstrations of {cell.task}"
            source = FitWeights(self.out / "fitted" / cell.task / name, fit, (demonstrated,), 1, space, count)
        if self.grid.sees_joints(cell):
            return source
        path = self.out / "unseen" / cell.task / name
        return HideJoints(path, f"hide the joints of {cell.task} {name}", (source,), 1, space)

    def training(self, cell: Cell, seed: int) -> Train:
        """The training of a cell's policy."""
        task, space, count = cell.task, space_of(cell.decoder), cell.demonstrations
        configuration = self.grid.configuration
        steps = self.grid.steps or default_steps(default_config(space, configuration))
        variant = f"{count}-demonstrations-{steps}-steps-seed-{seed}"
        if unseen := not self.grid.sees_joints(cell):
            variant += "-joints-unseen"
        return Train(
            self.out / "policies" / task / space / f"{variant}.json",
            f"train {task} {space} on {count} demonstrations, seed {seed}{', joints unseen' * unseen}",
            (self._source(cell),),
            size=steps,
            space=space,
            seed=seed,
            demonstrations=count,
            configuration=configuration,
        )

    def rollouts_of(self, cell: Cell) -> Iterator[RollOut]:
        """The rollouts of a cell, training seed by training seed."""
        end = FIRST_SEED + self.grid.rollouts
        for trained in (self.training(cell, seed) for seed in self.grid.seeds_of(cell)):
            width = "" if cell.within is None else f"-within-{cell.within:g}"
            folder = self.out / "rollouts" / cell.task / cell.decoder / f"{trained.path.stem}{width}"
            for first in range(FIRST_SEED, end, POLICY_ROWS):
                count = min(POLICY_ROWS, end - first)
                last = first + count - 1
                name = f"roll out {cell.decoder} from {first} to {last}{width.replace('-', ' ')} ({trained.name})"
                path = folder / f"{first}-{last}.json"
                yield RollOut(path, name, (trained,), count, cell.decoder, first, cell.within)
