"""``er-il retarget``: a dataset of one arm as a dataset of joints of another."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, Suppress, arg

from er_il.cli.arm_options import ArmOptions


@dataclass(frozen=True)
class SourceArm(ArmOptions):
    """The arm of the dataset, where it does not know it."""

    arm: Annotated[str, arg(name="from")] = ""
    """Preset, or path of a URDF, of the dataset's arm, if the dataset does not say it itself."""
    from_: Suppress[tuple[str, ...]] = ()  # joints in other columns: er-il encode --to joint puts them together first
    state_from: Suppress[tuple[str, ...]] = ()


def retarget(
    source: Positional[str],
    *,
    to: str,
    out: Path,
    robot: OmitArgPrefixes[SourceArm],
    to_ee_frame: str = "",
    scale: float | None = None,
    against: Path | None = None,
    repo_id: str = "",
    report: Path | None = None,
) -> None:
    """Write a LeRobot v3 dataset of one arm again as a dataset of joints of another.

    The other arm's end effector follows the same poses, positions scaled about the shoulder, and its elbow the same
    arm angle, frame by frame. Frames that it cannot reach are as near as can be, and reported.

    Args:
        source: Folder of the dataset, or its repository id on the hub.
        to: The new arm: a preset, a URDF (with --to-ee-frame), or for several arms a file of arms, one entry for each
            label; in a file, joints, units, signs and offsets can be the new robot's, too.
        out: Folder of the new dataset.
        robot: The arm of a dataset that does not know it.
        to_ee_frame: Link of the new arm's URDF that follows the poses.
        scale: Of positions about the shoulder; the ratio of the arms' reaches if omitted, 1 for the same places.
        against: Dataset of the new arm with the same frames: report how far the result is from it. For one that was
            retargeted to another arm, and now back.
        repo_id: Repository id that the dataset will have on the hub: its card then links to LeRobot's visualiser.
        report: Folder of report.json; outputs/retarget/<name of out> if omitted.
    """
    from rich.console import Console
    from rich.markup import escape

    from er_il.arms.presets import ROBOTS
    from er_il.cli.progress import make_progress
    from er_il.cli.table import write_study
    from er_il.datasets.dataset import Dataset
    from er_il.datasets.retargeted import retarget as retarget_dataset
    from er_il.datasets.wiring import Wiring, read_wirings
    from er_il.support.atomic_files import check_writable
    from er_il.support.provenance import provenance

    folder = report or Path("outputs/retarget") / out.name
    check_writable(folder)
    several = to in ROBOTS or Path(to).suffix in (".yaml", ".yml")
    arms = read_wirings(Path(to)) if several else [Wiring(arm=to, ee_frame=to_ee_frame)]
    wirings = robot.wirings()
    original = against and Dataset(against)
    if original:
        _ = original.layout  # raises where it does not say which arms it is of
    console = Console()
    with make_progress(console) as progress:
        bar = progress.add_task("Retarget", total=None, visible=False)  # until a frame is
        retargeted = retarget_dataset(
            source,
            out,
            arms,
            scale=scale,
            wirings=wirings,
            repo_id=repo_id,
            on_progress=lambda done, total: progress.update(bar, completed=done, total=total, visible=True),
        )
    from er_il.datasets.retargeting_report import compare_with, retargeting_report
    from er_il.report.text import sentences

    found = {"meta": provenance() | {"dataset": source, "out": str(out)}} | retargeting_report(retargeted)
    found["against"] = compare_with(original, retargeted) if original else {}
    for line in sentences("retarget.txt.j2", **found):
        console.print(escape(line), highlight=False, soft_wrap=True)
    write_study(found, folder, console, {})
    console.print(f"Check it: er-il verify {out}", highlight=False, soft_wrap=True)
