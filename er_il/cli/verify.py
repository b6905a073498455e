"""``er-il verify``: whether an encoded dataset gives its joints back."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tyro.conf import Positional

SHOWN = 5  # rows of a list that are printed; the report has all

_ROWS: dict[str, Callable[[dict[str, Any]], str]] = {
    "frames flagged": lambda arm: str(arm["flagged"]),
    "joint error [rad] p50, p95, p99, max": lambda arm: _numbers(arm["joint_error"]),
    "joint error [rad] max, not flagged": lambda arm: _numbers(arm["joint_error_unflagged"], "p100"),
    "position error [m] p50, p95, p99, max": lambda arm: _numbers(arm["position_error"]),
    "rotation error [rad] p50, p95, p99, max": lambda arm: _numbers(arm["rotation_error"]),
}


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
    from rich.markup import escape
    from rich.table import Table

    from er_il.cli.progress import make_progress
    from er_il.datasets.hub import find_dataset
    from er_il.datasets.verification import verify as verify_dataset
    from er_il.report.verification_plot import plot
    from er_il.support.errors import DatasetError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    folder = find_dataset(dataset)
    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task("Verify", total=None)
        verification = verify_dataset(
            folder, cores(), lambda done, total: progress.update(bar, completed=done, total=total)
        )
    report = verification.report()
    table = Table("", *report["arms"])
    for row, of_arm in _ROWS.items():
        table.add_row(escape(row), *(of_arm(arm) for arm in report["arms"].values()))
    console.print(f"{report['frames']} frames, {report['episodes']} episodes", highlight=False)
    console.print(table)
    for episode, counts in list(report["invalid_by_episode"].items())[:SHOWN]:
        listed = ", ".join(f"{status} {count}" for status, count in counts.items())
        console.print(f"Episode {episode}: {listed}", highlight=False)
    for stretch in report["near_singularity"][:SHOWN]:
        console.print(
            f"Episode {stretch['episode']}, {stretch['arm']}: near a singularity in frames {stretch['first']} to "
            f"{stretch['last']} (smallest singular value {stretch['smallest']:.1e})",
            highlight=False,
            soft_wrap=True,
        )
    more = max(0, len(report["invalid_by_episode"]) - SHOWN) + max(0, len(report["near_singularity"]) - SHOWN)
    if more:
        console.print(f"and {more} more in the report", highlight=False)
    for label, share in verification.other_side.items():
        if share > 0:
            console.print(
                f"{label}: {share:.1%} of the quaternions are beyond their hemisphere, where episodes may disagree "
                "about the sign. Encode with --rotation rot6d.",
                highlight=False,
                soft_wrap=True,
            )
    target = out or Path("outputs/verify") / Path(dataset).name
    plot(verification, target / "round_trip.png", dataset)
    path = target / "report.json"
    path.write_text(json.dumps({"meta": provenance() | {"dataset": dataset}} | report, indent=2))
    console.print(f"{path}\n{target / 'round_trip.png'}", highlight=False, soft_wrap=True)
    if verification.findings:
        raise DatasetError(" ".join(f"{label}: {text}" for label, text in verification.findings.items()))


def _numbers(percentiles: dict[str, float] | None, *chosen: str) -> str:
    if percentiles is None:
        return "joints not kept"
    return "  ".join(f"{value:.0e}" for name, value in percentiles.items() if not chosen or name in chosen) or "none"
