"""``er-il demo``: the main job in one command."""

from pathlib import Path


def demo(*, out: Path = Path("outputs/demo"), seed: int = 0) -> None:
    """Demonstrate Reach Cup, train a policy in joint, task and ERJ space, roll them out and compare.

    Interrupted, the same command resumes.

    Args:
        out: Folder of everything that it makes.
        seed: Seed of the demonstrations and the trainings.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.cli.table import results_table
    from er_il.demo import Demo
    from er_il.report import PAGE
    from er_il.workers import cores

    console = Console()
    with make_progress(console) as progress:
        cells = Demo(out, seed).run(progress, cores())
    console.print(results_table([cell.report() for cell in cells]))
    console.print(f"{out / PAGE}", highlight=False)
