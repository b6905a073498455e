"""``er-il study``: what the paper asks about action spaces, measured."""

from pathlib import Path
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, subcommand

REPORT = "report.json"


def joints(
    demos: Positional[tuple[str, ...]] = ("reach_cup",),
    *,
    episodes: int = 10,
    training: Path | None = None,
    out: Path = Path("outputs/study/joints"),
) -> None:
    """Which joint should ERJ command? Singularities, branch flips and round trips with each one.

    Args:
        demos: Folders of datasets of one arm, or tasks to record.
        episodes: Demonstrations to record of a task, or to look at in a dataset.
        training: Report of policies trained with several joints (decoders erj@<joint>), to compare the advice with.
        out: Folder of report.json, joints.png and the recorded demonstrations.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.experiments.studies.demos import study_demos
    from er_il.experiments.studies.joint_notes import training_notes
    from er_il.experiments.studies.joints import study_joints
    from er_il.experiments.studies.prediction import predict, read_training
    from er_il.report.joints_figure import plot
    from er_il.support.atomic_files import write_json
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    cells = read_training(training) if training else []
    console = Console()
    with make_progress(console) as progress:
        arm, of_sets = study_demos(demos, episodes, out / "demos", progress, cores())
        bar = progress.add_task("Measure joints", total=None)
        study = study_joints(
            arm, of_sets, cores(), lambda done, total: progress.update(bar, completed=done, total=total)
        )
    report = study.report()
    if training:
        report["training"] = predict(report, cells)
    meta = provenance() | {"demos": {name: len(paths) for name, paths in of_sets.items()}}
    write_json(out / REPORT, {"meta": meta} | report)
    plot(report, out / "joints.png")
    for note in (*report["notes"], *training_notes(report)):
        console.print(note, highlight=False)
    console.print(f"{out / REPORT}\n{out / 'joints.png'}", highlight=False, soft_wrap=True)


def validity(
    demos: Positional[tuple[str, ...]] = ("reach_cup",),
    *,
    episodes: int = 10,
    samples: int = 150,
    out: Path = Path("outputs/study/validity"),
) -> None:
    """Which actions are invalid, and why? Delta and absolute actions of growing size in task, ERJ and ERA.

    Args:
        demos: Folders of datasets of one arm, or tasks to record.
        episodes: Demonstrations to record of a task, or to look at in a dataset.
        samples: Actions of each size, in each space, around each kind of states.
        out: Folder of report.json, validity.png and the recorded demonstrations.
    """
    import numpy as np
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.experiments.studies.demos import study_demos
    from er_il.experiments.studies.validity import study_validity
    from er_il.experiments.studies.validity_report import report as summarised
    from er_il.report.validity_figure import plot
    from er_il.support.atomic_files import write_json
    from er_il.support.errors import ErIlError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    if samples < 1:
        raise ErIlError(f"{samples} samples are too few: at least one is needed.")
    console = Console()
    with make_progress(console) as progress:
        arm, of_sets = study_demos(demos, episodes, out / "demos", progress, cores())
        states = np.concatenate([path.measured for paths in of_sets.values() for path in paths])
        bar = progress.add_task("Draw and decode actions", total=None)
        outcomes = study_validity(
            arm, states, samples, cores(), lambda done, total: progress.update(bar, completed=done, total=total)
        )
    report = summarised(outcomes)
    meta = provenance() | {"arm": arm.name, "demos": {name: len(paths) for name, paths in of_sets.items()}}
    write_json(out / REPORT, {"meta": meta | {"samples": samples}} | report)
    plot(report, out / "validity.png")
    for finding in report["findings"]:
        console.print(finding, highlight=False)
    console.print(f"{out / REPORT}\n{out / 'validity.png'}", highlight=False, soft_wrap=True)


def deltas(
    demos: Positional[tuple[str, ...]] = ("reach_cup",),
    *,
    episodes: int = 10,
    out: Path = Path("outputs/study/deltas"),
) -> None:
    """Do changes add up? Demonstrations as deltas in every space, decoded one after the other.

    Args:
        demos: Folders of datasets of one arm, or tasks to record.
        episodes: Demonstrations to record of a task, or to look at in a dataset.
        out: Folder of report.json and the recorded demonstrations.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.experiments.studies.deltas import study_deltas
    from er_il.experiments.studies.demos import study_demos
    from er_il.support.atomic_files import write_json
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    console = Console()
    with make_progress(console) as progress:
        arm, of_sets = study_demos(demos, episodes, out / "demos", progress, cores())
    report = study_deltas(arm, of_sets)
    meta = provenance() | {"arm": arm.name, "demos": {name: len(paths) for name, paths in of_sets.items()}}
    write_json(out / REPORT, {"meta": meta} | report)
    for each in report["drifts"]:
        console.print(
            f"{each['space']}: {each['steps']} steps, joints off by {each['joints']:.1e} rad at most, "
            f"end effector by {each['position']:.1e} m, {each['invalid']} invalid",
            highlight=False,
        )
    console.print(str(out / REPORT), highlight=False, soft_wrap=True)


Study = (
    Annotated[Any, subcommand("validity", constructor=validity, prefix_name=False)]
    | Annotated[Any, subcommand("joints", constructor=joints, prefix_name=False)]
    | Annotated[Any, subcommand("deltas", constructor=deltas, prefix_name=False)]
)


def study(which: OmitArgPrefixes[Study]) -> None:
    """Studies of the action spaces, each with its figure and JSON."""
