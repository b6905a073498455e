"""``er-il demo``: the main job in one command."""

from pathlib import Path


def demo(
    *,
    out: Path | None = None,
    seed: int = 0,
    task: str = "reach_cup",
    decoders: str = "joint,erj,task-nearest,task-posture",
    demonstrations: int | None = None,
    steps: int | None = None,
    rollouts: int = 50,
) -> None:
    """Demonstrate a task, train a policy in each action space, roll them out and compare.

    Interrupted, the same command resumes.

    Args:
        out: Folder of everything that it makes; outputs/demo if omitted (outputs/<task> for another task).
        seed: Seed of the demonstrations and the trainings.
        task: Task, such as reach_cup or lift_cup.
        decoders: Decoders to compare, separated by commas: joint, erj, era, task-nearest, task-posture, task-clear.
        demonstrations: Number of demonstrations; the recipe's if omitted.
        steps: Training steps of a policy; the configuration's if omitted.
        rollouts: Number of rollouts of each decoder.
    """
    from rich.console import Console

    from er_il.cli.benchmark import report
    from er_il.experiments.grid import demo_grid

    grid = demo_grid(task, seed, tuple(decoders.split(",")), rollouts, demonstrations, steps)
    from er_il.cli.progress import make_progress
    from er_il.experiments.plan import Plan
    from er_il.support.workers import LocalExecutor, cores

    folder, console = out or Path("outputs") / ("demo" if task == "reach_cup" else task), Console()
    plan = Plan(grid, folder.resolve(), recorders=cores())
    plan.check()  # seconds of imports follow: mistakes are told before
    from er_il.experiments.imitation import Imitation
    from er_il.experiments.run import run

    # All trainings at once, be they more than the cores: in turns, a core would idle beside the last.
    with LocalExecutor(max(cores(), len(grid.spaces))) as executor, make_progress(console) as progress:
        outcome = run(Imitation(plan), executor, progress, folder, with_films=True)
    report(console, outcome, folder)
