"""``er-il verify``: round-trip errors of an encoded dataset, and sanity of any dataset's joint values."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, arg

from er_il.cli.arm_options import ArmOptions, Names
from er_il.cli.table import write_study

if TYPE_CHECKING:
    from rich.console import Console

    from er_il.datasets.verification import Verification


def verify(
    datasets: Annotated[Positional[tuple[str, ...]], arg(metavar="DATASET ...")],
    *,
    robot: OmitArgPrefixes[ArmOptions],
    episodes: Annotated[tuple[int, ...], arg(metavar="N ...")] = (),
    poses: Names = (),
    out: Path | None = None,
) -> None:
    """Decode a dataset's actions and compare them with the joint values that were encoded.

    Prints errors of the round trip, frames that cannot be decoded, and frames near singularities.
    Joint values that look like another arm's, or in another order or other units, are an error. Numbers that cannot
    be, and frames that do not come back though nothing flags them, end it with exit code 1. Recorded end-effector
    poses, where there are any, are compared with the joints: their convention, frame and residual are printed.
    A dataset whose actions are joints is encoded in each action space and decoded, in memory.

    Args:
        datasets: Folders of datasets, or their repository ids on the hub.
        robot: The arm of a dataset that does not know it, whose actions are then joints.
        episodes: Numbers of the episodes to look at; all if omitted.
        poses: Column that holds end-effector poses, then its dimensions if it holds more; found if omitted.
        out: Folder of report.json and round_trip.png, of several datasets one folder each in it;
            outputs/verify/<dataset> if omitted.
    """
    import sys

    from rich.console import Console

    from er_il.datasets.hub import find_dataset
    from er_il.support.atomic_files import check_writable
    from er_il.support.errors import DatasetError

    if not datasets:
        raise DatasetError("Which dataset? Give its folder, or its repository id on the hub.")
    wirings = robot.wirings()
    folders = _folders(datasets, out)
    check_writable(*folders)
    roots = [find_dataset(dataset) for dataset in datasets]
    from er_il.datasets.number_checks import described

    console = Console()
    findings, broken = [], False
    for dataset, root, folder in zip(datasets, roots, folders, strict=True):
        verification = _verify(dataset, root, folder, wirings, episodes, poses, console)
        prefix = f"{dataset}: " if len(datasets) > 1 else ""
        found = [f"{prefix}{label}: {text}" for label, text in verification.findings.items()]
        if problems := verification.broken():
            print(
                " ".join([f"error: {prefix}{described(problems, len(verification.episodes))}", *found]), file=sys.stderr
            )
            broken = True
        else:
            findings += found
    if broken:
        sys.exit(1)
    if findings:
        raise DatasetError(" ".join(findings))


def _verify(
    dataset: str,
    root: Path,
    folder: Path,
    wirings: Sequence[Any],
    episodes: Sequence[int],
    poses: Names,
    console: "Console",
) -> "Verification":
    """Verify a dataset and report it."""
    from rich.markup import escape

    from er_il.cli.progress import make_progress
    from er_il.datasets.space_checks import verify_in_spaces
    from er_il.datasets.verification import read_whole
    from er_il.datasets.verification import verify as verify_dataset
    from er_il.report.tables import terminal_table
    from er_il.report.text import sentences, table
    from er_il.report.verification import verification_figure
    from er_il.spaces.joint import JOINT
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    read, layout = read_whole(root, wirings, episodes)
    with make_progress(console) as progress:

        def check(what: str, function: Any, *more: Any) -> Any:
            bar = progress.add_task(what, total=None)

            def shown(done: int, total: int) -> None:
                progress.update(bar, completed=done, total=total)

            return function(read, layout, cores(), shown, *more)

        verification = check("Verify", verify_dataset, poses)
        sound = not (verification.findings or verification.broken())
        in_spaces = check("Try spaces", verify_in_spaces) if layout.kind == JOINT and sound else {}
    report = {"meta": provenance() | {"dataset": dataset}} | verification.report()
    report["spaces"] = {kind: each.report()["arms"] for kind, each in in_spaces.items()}
    console.print(f"{report['frames']} frames, {report['episodes']} episodes", highlight=False)
    console.print(terminal_table(table("verification", **report)))
    if in_spaces:
        console.print(terminal_table(table("spaces", **report)))
    for note in sentences("verification.txt.j2", **report):
        console.print(escape(note), highlight=False, soft_wrap=True)
    write_study(report, folder, console, {"round_trip.png": lambda _: verification_figure(verification, dataset)})
    return verification


def _folders(datasets: Sequence[str], out: Path | None) -> list[Path]:
    """Where each dataset's report goes: by as much of the end of its path as tells it from the others."""
    if len(datasets) == 1 and out is not None:
        return [out]
    parts = [Path(dataset).parts for dataset in datasets]
    length = next(
        (n for n in range(1, max(map(len, parts)) + 1) if len({each[-n:] for each in parts}) == len(parts)), 1
    )
    return [(out or Path("outputs/verify")) / "_".join(each[-length:]).replace("/", "") for each in parts]
