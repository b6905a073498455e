"""The demo: a small grid of one task, whose films stand among the results."""

from pathlib import Path

from rich.progress import Progress

from er_il.datasets.recipe import Recipe
from er_il.evaluation.posture_baselines import space_of
from er_il.experiments.grid import Grid
from er_il.experiments.plan import Plan
from er_il.experiments.run import Outcome, run
from er_il.support.workers import LocalExecutor, cores

TASK = "reach_cup"
INTRODUCTION = (
    "The same demonstrations of a scripted leader arm, encoded in each action space; one Action Chunking Transformer "
    "trained on each encoding, with the same settings; each policy rolled out from the same initial states, which no "
    "demonstration had. The two task decoders run the same policy: they differ in what inverse kinematics does with "
    "the elbow that a task-space action leaves open."
)


def demo_grid(
    task: str, seed: int, decoders: tuple[str, ...], rollouts: int, demonstrations: int | None, steps: int | None
) -> Grid:
    """Return the grid of a demo.

    Args:
        task: Task to demonstrate.
        seed: Seed of the demonstrations and of the trainings.
        decoders: Decoders to compare.
        rollouts: Number of rollouts of each decoder.
        demonstrations: Number of demonstrations, those held out included; the recipe's if None.
        steps: Training steps of a policy; the configuration's if None.

    Raises:
        GridError: a number is too small.
        UnknownNameError: unknown task or decoder.
    """
    recipe = Recipe.load(task)
    if demonstrations is not None:
        recipe = recipe.resized(demonstrations)
    return Grid.from_dict(
        {
            "title": f"er_il demo: {task}",
            "introduction": INTRODUCTION,
            "tasks": [task],
            "decoders": list(decoders),
            "training_seeds": [seed],
            "recording_seed": seed,
            "rollouts": rollouts,
            "demonstrations": [recipe.episodes - recipe.validation],
            "episodes": demonstrations,
            "steps": steps,
        }
    )


def run_demo(grid: Grid, out: Path, progress: Progress) -> Outcome:
    """Run a demo's grid on this machine; all that it makes goes into a folder, films of each decoder as well."""
    spaces = {space_of(name) for name in grid.decoders}
    plan = Plan(grid, out.resolve(), recorders=cores())
    # All trainings at once, be they more than the cores: in turns, a core would idle beside the last.
    with LocalExecutor(max(cores(), len(spaces))) as executor:
        return run(plan, executor, progress, out, filmed=grid.decoders, with_films=True)
