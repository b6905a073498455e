"""``er-il benchmark``: a grid of tasks, decoders and training seeds, run and reported."""

from pathlib import Path
from typing import TYPE_CHECKING

from tyro.conf import Positional

if TYPE_CHECKING:
    from rich.console import Console

    from er_il.experiments.run import Outcome


def benchmark(
    grid: Positional[Path],
    *,
    out: Path | None = None,
    results: Path | None = None,
    ray_address: str | None = None,
    report_only: bool = False,
    add: bool = False,
) -> None:
    """Run what a grid file asks for: trainings and rollouts of every cell, and what they need; then report.

    Interrupted, the same command resumes. A cell that fails is reported and does not stop the rest. A grid
    that is done is only reported again.

    Args:
        grid: YAML file, such as configs/table1.yaml, or of agents, such as configs/rl_full_body.yaml.
        out: Folder of everything that it makes; outputs/benchmark/<name of the grid file> if omitted.
        results: Folder of the report; results/<name of the grid file> if omitted.
        ray_address: Address of a Ray cluster to run on, such as 10.0.0.5:6379, whose machines share the folder
            ``out``; the cores of this machine if omitted.
        report_only: Run nothing: report the cells that are complete by now, also while another command works on others.
        add: Add to the report in ``results``: its cells are neither run nor dropped, unless ``out`` has them. For grids
            of agents that are run part by part, or on several machines.
    """
    from rich.console import Console

    from er_il.experiments.kinds import experiment_of, read_plan

    folder, console = results or Path("results") / grid.stem, Console()
    plan = read_plan(grid, (out or Path("outputs/benchmark") / grid.stem).resolve(), folder if add else None)
    from er_il.cli.progress import make_progress
    from er_il.experiments.cluster import RayExecutor
    from er_il.support.atomic_files import check_writable
    from er_il.support.workers import LocalExecutor, cores

    check_writable(plan.out, folder)
    plan.check()  # seconds of imports follow: mistakes are told before
    if report_only:
        from er_il.experiments.run import report_complete

        outcome = report_complete(experiment_of(plan), folder)
    else:
        workplace = RayExecutor(ray_address) if ray_address else LocalExecutor(cores())
        with workplace as executor, make_progress(console) as progress:
            from er_il.experiments.run import run

            outcome = run(experiment_of(plan), executor, progress, folder)
    report(console, outcome, folder)


def report(console: "Console", outcome: "Outcome", folder: Path) -> None:
    """Print the results of an experiment and what is missing; exit with 1 if cells are incomplete."""
    import sys

    from er_il.cli.table import results_table
    from er_il.report.grid_page import PAGE

    console.print(results_table(outcome.report["cells"]))
    console.print(f"{folder / PAGE}", highlight=False, soft_wrap=True)
    for message in outcome.unfilmed:
        console.print(f"No film: {message}", highlight=False)
    for message in outcome.failures:
        console.print(f"Failed: {message}", style="red", highlight=False)
    if outcome.failures:
        console.print(f"{len(outcome.report['meta']['missing'])} cells are incomplete. The same command tries again.")
        sys.exit(1)
