"""The demo: a small grid of one task, whose films stand among the results."""

from pathlib import Path

from rich.progress import Progress

from er_il.datasets.recipe import Recipe
from er_il.experiments.grid import Grid
from er_il.experiments.plan import Plan
from er_il.experiments.run import Outcome, run
from er_il.support.resources import data_dir
from er_il.support.workers import LocalExecutor, cores


def demo_grid(
    task: str, seed: int, decoders: tuple[str, ...], rollouts: int, demonstrations: int | None, steps: int | None
) -> Grid:
    """Return the grid of ``configs/demo.yaml`` with other values, which are those of ``er-il demo``.

    Raises:
        GridError: a number is too small.
        UnknownNameError: unknown task or decoder.
    """
    grid, recipe = Grid.from_file(data_dir("configs") / "demo.yaml"), Recipe.load(task)
    if demonstrations is not None:
        recipe = recipe.resized(demonstrations)
    return grid.replaced(
        title=f"{grid.title}: {task}",
        tasks=(task,),
        decoders=decoders,
        training_seeds=(seed,),
        recording_seed=seed,
        rollouts=rollouts,
        demonstrations=(recipe.episodes - recipe.validation,),
        episodes=demonstrations,
        steps=steps,
    )


def run_demo(grid: Grid, out: Path, progress: Progress) -> Outcome:
    """Run a demo's grid on this machine; all that it makes goes into a folder, films of each decoder as well."""
    # All trainings at once, be they more than the cores: in turns, a core would idle beside the last.
    with LocalExecutor(max(cores(), len(grid.spaces))) as executor:
        return run(Plan(grid, out.resolve(), recorders=cores()), executor, progress, out, with_films=True)
