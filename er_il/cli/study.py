"""``er-il study``: studies of the action spaces along demonstrations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, subcommand

from er_il.cli.table import write_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from er_il.arms.arm import Arm
    from er_il.experiments.studies import Demos

    Measure = Callable[[Arm, Demos, Callable[[int, int], object]], dict[str, Any]]


@dataclass(frozen=True)
class StudyOptions:
    """The demonstrations that a study looks at, and where its results go."""

    demos: Positional[tuple[str, ...]] = ("reach_cup",)
    """Folders of datasets of one arm, or tasks to record."""
    episodes: int = 10
    """Demonstrations to record of a task, or to look at in a dataset."""
    out: Path | None = None
    """Folder of report.json, the figure and the recorded demonstrations; outputs/study/<study> if omitted."""

    def check(self) -> None:
        """Tell mistakes before seconds of imports."""
        from er_il.experiments.studies.demos import check_demos

        check_demos(self.demos, self.episodes)

    def run(
        self,
        name: str,
        measure: "Measure",
        shown: Callable[[dict[str, Any]], list[Any]],
        draw: "Callable[[Mapping[str, Any]], Figure] | None" = None,
        **settings: object,
    ) -> None:
        """Measure, print what is ``shown`` of the report, write it and its figure."""
        from rich.console import Console

        from er_il.cli.progress import make_progress
        from er_il.experiments.studies.demos import study_demos
        from er_il.support.provenance import provenance
        from er_il.support.workers import cores

        console, out = Console(), self.out or Path("outputs/study") / name
        with make_progress(console) as progress:
            arm, of_sets = study_demos(self.demos, self.episodes, out / "demos", progress, cores())
            bar = progress.add_task("Measure", total=None)
            report = measure(arm, of_sets, lambda done, total: progress.update(bar, completed=done, total=total))
        meta = provenance() | {"arm": arm.name, "demos": {each: len(paths) for each, paths in of_sets.items()}}
        for each in shown(report):
            console.print(each, highlight=False)
        write_study({"meta": meta | settings} | report, out, console, {f"{name}.png": draw} if draw else {})


def joints(study: OmitArgPrefixes[StudyOptions], *, training: Path | None = None) -> None:
    """Which joint should ERJ command? Singularities, branch flips and round trips with each one.

    Args:
        study: Demonstrations and results.
        training: Report of policies trained with several joints (decoders erj@<joint>), to compare the advice with.
    """
    from er_il.experiments.studies.prediction import predict, read_training

    study.check()
    cells = read_training(training) if training else []
    from er_il.experiments.studies.joints import study_joints
    from er_il.report.joints import joints_figure, notes
    from er_il.support.workers import cores

    def measure(arm: "Arm", demos: "Demos", advance: Callable[[int, int], object]) -> dict[str, Any]:
        report = study_joints(arm, demos, cores(), advance)
        return report | ({"training": predict(report, cells)} if training else {})

    study.run("joints", measure, notes, joints_figure)


def validity(study: OmitArgPrefixes[StudyOptions], *, samples: int = 150) -> None:
    """Which actions are invalid, and why? Delta and absolute actions of growing size in task, ERJ, ERA and ERX.

    Args:
        study: Demonstrations and results.
        samples: Actions of each size, in each space, around each kind of states.
    """
    from er_il.support.errors import ErIlError

    if samples < 1:
        raise ErIlError(f"{samples} samples are too few: at least one is needed.")
    study.check()
    from er_il.experiments.studies.validity import study_validity
    from er_il.report.validity import findings, validity_figure
    from er_il.support.workers import cores

    def measure(arm: "Arm", demos: "Demos", advance: Callable[[int, int], object]) -> dict[str, Any]:
        return study_validity(arm, demos, samples, cores(), advance)

    study.run("validity", measure, findings, validity_figure, samples=samples)


def deltas(study: OmitArgPrefixes[StudyOptions]) -> None:
    """Do changes add up? Demonstrations as deltas in every space, decoded one after the other.

    Args:
        study: Demonstrations and results.
    """
    study.check()
    from er_il.experiments.studies.deltas import study_deltas
    from er_il.report.tables import terminal_table
    from er_il.report.text import table

    study.run("deltas", study_deltas, lambda report: [terminal_table(table("deltas", **report))])


def margins(study: OmitArgPrefixes[StudyOptions]) -> None:
    """How far do demonstrations stay from folds? Margins and risk of ERJ's joints, ERA and ERX, fitted and not.

    Args:
        study: Demonstrations and results.
    """
    study.check()
    from er_il.experiments.studies.margins import study_margins
    from er_il.report.margins import margins_figure, margins_texts, playback_texts
    from er_il.report.tables import terminal_table
    from er_il.support.workers import cores

    def measure(arm: "Arm", demos: "Demos", advance: Callable[[int, int], object]) -> dict[str, Any]:
        return study_margins(arm, demos, cores(), advance)

    def shown(report: dict[str, Any]) -> list[Any]:
        return [*map(terminal_table, (margins_texts(report), playback_texts(report))), *report["notes"]]

    study.run("margins", measure, shown, margins_figure)


def elbow_angle(study: OmitArgPrefixes[StudyOptions]) -> None:
    """What does the arm angle say of the joints? ERA with both references beside ERJ, with errors like a policy's.

    Args:
        study: Demonstrations and results.
    """
    study.check()
    from er_il.experiments.studies.elbow_angle import study_elbow_angle
    from er_il.report.tables import terminal_table
    from er_il.report.text import table
    from er_il.support.workers import cores

    def measure(arm: "Arm", demos: "Demos", advance: Callable[[int, int], object]) -> dict[str, Any]:
        return study_elbow_angle(arm, demos, cores(), advance)

    study.run("elbow_angle", measure, lambda report: [terminal_table(table("elbow_angles", **report))])


Study = (
    Annotated[Any, subcommand("validity", constructor=validity, prefix_name=False)]
    | Annotated[Any, subcommand("joints", constructor=joints, prefix_name=False)]
    | Annotated[Any, subcommand("deltas", constructor=deltas, prefix_name=False)]
    | Annotated[Any, subcommand("margins", constructor=margins, prefix_name=False)]
    | Annotated[Any, subcommand("elbow_angle", constructor=elbow_angle, prefix_name=False)]
)


def study(which: OmitArgPrefixes[Study]) -> None:
    """Studies of the action spaces, each with its figure and JSON."""
