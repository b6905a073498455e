"""``er-il verify``: whether an encoded dataset gives its joints back."""

from pathlib import Path

from tyro.conf import Positional

SHOWN = 5  # rows of a list that are printed; the report has all


def verify(dataset: Positional[str], *, out: Path | None = None) -> None:
    """Decode a dataset's actions and compare them with the joint values that were encoded.

    Prints errors of the round trip, frames that cannot be decoded, and stretches near singularities.
    Joint values that look like another arm's, or in another order or other units, are an error.

    Args:
        dataset: Folder of the dataset, or its repository id on the hub.
        out: Folder of report.json and round_trip.png; outputs/verify/<dataset> if omitted.
    """
    import json

    from rich.console import Console
    from rich.table import Table

    from er_il.cli.progress import make_progress
    from er_il.errors import DatasetError
    from er_il.hub import find_dataset
    from er_il.provenance import provenance
    from er_il.verification import verify as verify_dataset
    from er_il.verification_plot import plot
    from er_il.workers import cores

    folder = find_dataset(dataset)
    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task("Verify", total=None)
        verification = verify_dataset(
            folder, cores(), lambda done, total: progress.update(bar, completed=done, total=total)
        )
    report = verification.report()
    table = Table("arm", "frames", "flagged", "joint error [rad] p50", "p95", "p99", "max", "max unflagged")
    for label, arm in report["arms"].items():
        errors = (arm["joint_error"] or {}).values()
        clear = (arm["joint_error_unflagged"] or {}).get("p100")
        cells = [f"{value:.1e}" for value in errors] or ["not kept"] * 4
        table.add_row(
            label, str(report["frames"]), str(arm["flagged"]), *cells, "" if clear is None else f"{clear:.1e}"
        )
    console.print(table)
    for episode, counts in list(report["invalid_by_episode"].items())[:SHOWN]:
        listed = ", ".join(f"{status} {count}" for status, count in counts.items())
        console.print(f"Episode {episode}: {listed}", highlight=False)
    for stretch in report["near_singularity"][:SHOWN]:
        console.print(
            f"Episode {stretch['episode']}, {stretch['arm']}: near a singularity in frames {stretch['first']} to "
            f"{stretch['last']} (smallest singular value {stretch['smallest']:.1e})",
            highlight=False,
        )
    more = max(0, len(report["invalid_by_episode"]) - SHOWN) + max(0, len(report["near_singularity"]) - SHOWN)
    if more:
        console.print(f"and {more} more in the report", highlight=False)
    target = out or Path("outputs/verify") / folder.name
    plot(verification, target / "round_trip.png", dataset)
    path = target / "report.json"
    path.write_text(json.dumps({"meta": provenance() | {"dataset": dataset}} | report, indent=2))
    console.print(f"{path}\n{target / 'round_trip.png'}", highlight=False, soft_wrap=True)
    if verification.suspicions:
        raise DatasetError(" ".join(f"{label}: {text}" for label, text in verification.suspicions.items()))
