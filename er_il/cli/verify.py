"""``er-il verify``: round-trip errors of an encoded dataset."""

from pathlib import Path

from tyro.conf import Positional

from er_il.cli.arm_options import Names
from er_il.cli.table import write_study


def verify(dataset: Positional[str], *, poses: Names = (), out: Path | None = None) -> None:
    """Decode a dataset's actions and compare them with the joint values that were encoded.

    Prints errors of the round trip, frames that cannot be decoded, and frames near singularities.
    Joint values that look like another arm's, or in another order or other units, are an error. Numbers that cannot
    be, and frames that do not come back though nothing flags them, end it with exit code 1. Recorded end-effector
    poses, where there are any, are compared with the joints: their convention, frame and residual are printed.

    Args:
        dataset: Folder of the dataset, or its repository id on the hub.
        poses: Column that holds end-effector poses, then its dimensions if it holds more; found if omitted.
        out: Folder of report.json and round_trip.png; outputs/verify/<dataset> if omitted.
    """
    import sys

    from rich.console import Console
    from rich.markup import escape

    from er_il.cli.progress import make_progress
    from er_il.datasets.dataset import Dataset
    from er_il.datasets.hub import find_dataset
    from er_il.support.atomic_files import check_writable
    from er_il.support.errors import DatasetError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    target = out or Path("outputs/verify") / Path(dataset).name
    check_writable(target)
    folder = find_dataset(dataset)
    _ = Dataset(folder).layout  # seconds of imports follow: mistakes are told before
    from er_il.datasets.number_checks import described
    from er_il.datasets.verification import verify as verify_dataset
    from er_il.report.tables import terminal_table
    from er_il.report.text import sentences, table
    from er_il.report.verification import verification_figure

    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task("Verify", total=None)
        verification = verify_dataset(
            folder, cores(), lambda done, total: progress.update(bar, completed=done, total=total), poses
        )
    report = {"meta": provenance() | {"dataset": dataset}} | verification.report()
    console.print(f"{report['frames']} frames, {report['episodes']} episodes", highlight=False)
    console.print(terminal_table(table("verification", **report)))
    for note in sentences("verification.txt.j2", **report):
        console.print(escape(note), highlight=False, soft_wrap=True)
    write_study(report, target, console, {"round_trip.png": lambda _: verification_figure(verification, dataset)})
    findings = [f"{label}: {text}" for label, text in verification.findings.items()]
    if broken := verification.broken():
        print(" ".join(["error:", described(broken, len(verification.episodes)), *findings]), file=sys.stderr)
        sys.exit(1)
    if findings:
        raise DatasetError(" ".join(findings))
