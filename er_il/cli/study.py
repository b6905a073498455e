"""``er-il study``: studies of the action spaces along demonstrations."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, subcommand

from er_il.cli.table import write_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from er_il.arms.arm import Arm
    from er_il.experiments.studies.joints import Demos

Report = dict[str, Any]


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
    from er_il.experiments.studies.joints import study_joints
    from er_il.experiments.studies.prediction import predict, read_training
    from er_il.report.joints import joints_figure, notes, training_notes
    from er_il.support.workers import cores

    cells = read_training(training) if training else []

    def measure(arm: "Arm", of_sets: "Demos", advance: Callable[[int, int], object]) -> Report:
        report = study_joints(arm, of_sets, cores(), advance)
        return report | ({"training": predict(report, cells)} if training else {})

    _study(
        demos,
        episodes,
        out,
        measure,
        {},
        lambda report: notes(report) + training_notes(report),
        {"joints.png": joints_figure},
    )


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

    from er_il.experiments.studies.validity import study_validity, summarise
    from er_il.report.validity import findings, validity_figure
    from er_il.support.errors import ErIlError
    from er_il.support.workers import cores

    if samples < 1:
        raise ErIlError(f"{samples} samples are too few: at least one is needed.")

    def measure(arm: "Arm", of_sets: "Demos", advance: Callable[[int, int], object]) -> Report:
        states = np.concatenate([path.measured for paths in of_sets.values() for path in paths])
        return summarise(study_validity(arm, states, samples, cores(), advance))

    _study(demos, episodes, out, measure, {"samples": samples}, findings, {"validity.png": validity_figure})


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
    from er_il.experiments.studies.deltas import study_deltas
    from er_il.report.tables import DELTA_COLUMNS, terminal_table

    _study(
        demos,
        episodes,
        out,
        lambda arm, of_sets, advance: study_deltas(arm, of_sets),
        {},
        lambda report: [terminal_table(report["drifts"], DELTA_COLUMNS)],
    )


def _study(
    names: tuple[str, ...],
    episodes: int,
    out: Path,
    measure: "Callable[[Arm, Demos, Callable[[int, int], object]], Report]",
    settings: dict[str, Any],
    shown: Callable[[Report], list[Any]],
    figures: "Mapping[str, Callable[[Report], Figure]]" = MappingProxyType({}),
) -> None:
    """Read or record demonstrations, measure, print what is ``shown`` of the report, write it and its figures."""
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.experiments.studies.demos import study_demos
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    console = Console()
    with make_progress(console) as progress:
        arm, of_sets = study_demos(names, episodes, out / "demos", progress, cores())
        bar = progress.add_task("Measure", total=None)
        report = measure(arm, of_sets, lambda done, total: progress.update(bar, completed=done, total=total))
    meta = provenance() | {"arm": arm.name, "demos": {name: len(paths) for name, paths in of_sets.items()}}
    for each in shown(report):
        console.print(each, highlight=False)
    write_study({"meta": meta | settings} | report, out, console, figures)


Study = (
    Annotated[Any, subcommand("validity", constructor=validity, prefix_name=False)]
    | Annotated[Any, subcommand("joints", constructor=joints, prefix_name=False)]
    | Annotated[Any, subcommand("deltas", constructor=deltas, prefix_name=False)]
)


def study(which: OmitArgPrefixes[Study]) -> None:
    """Studies of the action spaces, each with its figure and JSON."""
