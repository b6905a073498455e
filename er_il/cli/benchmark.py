"""``er-il benchmark``: a grid of tasks, decoders and training seeds, run and reported."""

from pathlib import Path

from tyro.conf import Positional


def benchmark(
    grid: Positional[Path], *, out: Path | None = None, results: Path | None = None, ray_address: str | None = None
) -> None:
    """Run what a grid file asks for: demonstrations, trainings and rollouts of every cell; then report.

    Interrupted, the same command resumes. A cell that fails is reported and does not stop the rest. A grid
    that is done is only reported again.

    Args:
        grid: YAML file, such as configs/table1.yaml.
        out: Folder of everything that it makes; outputs/benchmark/<name of the grid file> if omitted.
        results: Folder of the report; results/<name of the grid file> if omitted.
        ray_address: Address of a Ray cluster to run on, such as 10.0.0.5:6379, whose machines share the folder
            ``out``; the cores of this machine if omitted.
    """
    import sys

    from rich.console import Console
    from rich.live import Live

    from er_il.benchmark.account import Account
    from er_il.benchmark.cluster import RayExecutor
    from er_il.benchmark.grid import Grid
    from er_il.benchmark.page import PAGE, write_pages
    from er_il.benchmark.plan import Plan
    from er_il.benchmark.report import write_results
    from er_il.benchmark.strip import copy_strips, strips
    from er_il.benchmark.view import View
    from er_il.cli.table import results_table
    from er_il.schedule import Schedule
    from er_il.workers import LocalExecutor, cores

    plan = Plan(Grid.from_file(grid), (out or Path("outputs/benchmark") / grid.stem).resolve())
    plan.claim()
    console = Console()
    schedule = Schedule(plan.jobs)
    with RayExecutor(ray_address) if ray_address else LocalExecutor(cores()) as executor:
        view = View(Account(plan, schedule), schedule, executor, console)
        with Live(view, console=console, refresh_per_second=2):
            schedule.run(executor, view.update)
        folder = results or Path("results") / grid.stem
        report = write_results(plan, folder)
        console.print("\nThe results are written; pictures follow.", highlight=False)
        pictures = strips(plan)
        drawing = Schedule(pictures.values())
        drawing.run(executor)
    copy_strips(pictures, folder)
    write_pages(folder)
    console.print(results_table(report["cells"]))
    console.print(f"{folder / PAGE}", highlight=False, soft_wrap=True)
    for message in drawing.failed.values():
        console.print(f"No strip: {message}", highlight=False)
    for message in schedule.failed.values():
        console.print(f"Failed: {message}", style="red", highlight=False)
    if schedule.failed:
        console.print(f"{len(report['meta']['missing'])} cells are incomplete. The same command tries again.")
        sys.exit(1)
