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
        decoders: Decoders to compare, separated by commas: joint, erj, era, task-nearest, task-posture.
        demonstrations: Number of demonstrations; the recipe's if omitted.
        steps: Training steps of a policy; the configuration's if omitted.
        rollouts: Number of rollouts of each decoder.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.cli.table import results_table
    from er_il.experiments.demo import TASK, Demo
    from er_il.report.demo_page import PAGE
    from er_il.support.workers import cores

    folder = out or Path("outputs") / ("demo" if task == TASK else task)
    run = Demo(folder, seed, task, tuple(decoders.split(",")), rollouts, demonstrations, steps)
    console = Console()
    with make_progress(console) as progress:
        cells = run.run(progress, cores())
    console.print(results_table([cell.report() for cell in cells]))
    console.print(f"{folder / PAGE}", highlight=False)
