"""``er-il replay``: execute recorded demonstrations again, through each encoding."""

from pathlib import Path

from tyro.conf import Positional


def replay(datasets: Positional[tuple[str, ...]], *, out: Path = Path("outputs/replay")) -> None:
    """Execute recorded demonstrations again through each decoder: the ceiling of each encoding.

    Args:
        datasets: Datasets, folders of datasets, or tasks, such as reach_cup.
        out: Folder of report.json.
    """
    from rich.console import Console
    from rich.table import Table

    from er_il.cli.progress import make_progress
    from er_il.datasets.hub import find_datasets
    from er_il.support.atomic_files import check_writable
    from er_il.support.counts import tally
    from er_il.support.errors import DatasetError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    if not datasets:
        raise DatasetError("Name a dataset or a task, such as reach_cup.")
    check_writable(out)
    found = find_datasets(datasets)
    from er_il.evaluation.replay import replay as replay_datasets
    from er_il.evaluation.replay import write_report

    console = Console()
    with make_progress(console) as progress:
        bars = {}

        def advance(dataset: Path, decoder: str, done: int, total: int) -> None:
            if (dataset, decoder) not in bars:
                bars[dataset, decoder] = progress.add_task(f"Replay {dataset.parent.name} {decoder}", total=total)
            progress.update(bars[dataset, decoder], completed=done)

        cells = replay_datasets(found, cores(), advance)
    table = Table("task", "decoder", "success (exact 95 %)", "failures", "invalid", "off by [rad]")
    for cell in cells:
        report = cell.report()
        low, high = report["interval"]
        table.add_row(
            cell.task,
            cell.decoder,
            f"{cell.successes}/{len(cell.demos)} ({100 * low:.0f} to {high:.0%})",
            tally(report["failures"]),
            f"{report['invalid_rate']:.1%}",
            f"{report['max_joint_deviation']:.4f}",
        )
    console.print(table)
    path = out / "report.json"
    # Of a dataset's path the names that tell it, not the machine's folders before.
    names = ["/".join(dataset.resolve().parts[-2:]) for dataset in found]
    write_report(cells, provenance() | {"datasets": names}, path)
    console.print(str(path), highlight=False, soft_wrap=True)
