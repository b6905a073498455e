"""``er-il advise``: which joints ERJ should command, or what ERX should measure, for an arm and its demonstrations."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional

from er_il.cli.arm_options import ArmOptions

if TYPE_CHECKING:
    from er_il.arms.arm import Arm
    from er_il.experiments.studies import Demos

ROWS = 10  # of the table; --json has all
EPISODES = 10


def advise(
    source: Positional[str],
    *,
    robot: OmitArgPrefixes[ArmOptions],
    episodes: int | None = None,
    fit: Literal["erx"] | None = None,
    weights: Path | None = None,
    json: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Recommend the joints that ERJ should command, n-6 of them, and say why.

    Measures every choice over the workspace and along the demonstrations, if a dataset is given. With --fit erx it
    fits ERX's weights to the demonstrations instead, and compares their margin from folds with that of ERJ and ERA.

    Args:
        source: Folder or repository id of a dataset, a preset, or a URDF (with --ee-frame).
        robot: The arm of a dataset that does not know it, or the frames and joints of a URDF.
        episodes: Episodes of the dataset to look at, spread evenly; 10 if omitted, with --fit all.
        fit: erx: fit its weights.
        weights: File (.json) for the fitted weights, for er-il encode and er-il generate.
        json: File (.json) for all figures; with several arms, one each.
        plot: File (.png) for the picture; with several arms, one each.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.spaces.joint_choice import choices
    from er_il.support.atomic_files import check_writable, write_json
    from er_il.support.errors import DatasetError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    if weights and not fit:
        raise DatasetError("--weights is for --fit erx.")
    check_writable(json, plot, weights)
    console = Console()
    found = _arms(source, robot, episodes if fit or episodes is not None else EPISODES)
    for arm, demos in found.values():
        choices(arm)  # an arm without redundancy is an error before another one is measured
        if fit and not demos:
            raise DatasetError(f"{source} has no demonstrations to fit {fit} to: its weights are then the arm's own.")
    from er_il.report.style import save  # seconds of imports: mistakes are told before
    from er_il.report.tables import terminal_table

    if fit:
        from er_il.experiments.studies.margins import study_margins as study
        from er_il.report.margins import margins_figure as draw
        from er_il.report.margins import margins_texts as texts
    else:
        from er_il.experiments.studies.joints import study_joints as study
        from er_il.report.joints import advice_texts as texts
        from er_il.report.joints import joints_figure as draw

    with make_progress(console) as progress:
        reports = {}
        for label, (arm, demos) in found.items():
            bar = progress.add_task(f"Measure {label or arm.name}", total=None)
            reports[label] = study(
                arm, demos, cores(), lambda done, total, bar=bar: progress.update(bar, completed=done, total=total)
            )
    for label, report in reports.items():
        rows = texts(report)
        console.print(terminal_table(rows.head(ROWS)))
        if (more := len(rows) - ROWS) > 0:
            console.print(f"and {more} more, with --json", highlight=False)
        for note in report["notes"]:
            console.print(note, highlight=False)
        if json:
            write_json(_named(json, label), {"meta": provenance() | {"source": source}} | report)
        if plot:
            save(draw(report), _named(plot, label))
    if weights:
        _write_weights(weights, found, reports)
        console.print(str(weights), highlight=False, soft_wrap=True)


def _write_weights(path: Path, found: "dict[str, tuple[Arm, Demos]]", reports: "dict[str, dict[str, Any]]") -> None:
    """Write the weights that were fitted to each arm's demonstrations."""
    from er_il.datasets.weights import ArmWeights, WeightsFile

    fitted = {label: report["coordinates"][-1]["weights"] for label, report in reports.items()}
    arms = {label: ArmWeights.of(arm, fitted[label]) for label, (arm, _) in found.items()}
    WeightsFile(arms=arms).write(path)


def _arms(source: str, robot: ArmOptions, episodes: int | None) -> "dict[str, tuple[Arm, Demos]]":
    """Each arm by its label, and its demonstrations."""
    from dataclasses import replace

    from er_il.arms.presets import PRESETS
    from er_il.support.errors import DatasetError

    if source in PRESETS or (Path(source).is_file() and Path(source).suffix in (".urdf", ".xml")):
        if robot.arm or robot.arms:
            raise DatasetError(f"{source} is an arm: --arm and --arms are for datasets that do not know theirs.")
        return {"": (replace(robot, arm=source).wiring().build_arm(), {})}
    wirings = robot.wirings()
    if Path(source).suffix in (".urdf", ".xml"):
        raise DatasetError(f"There is no file {source}. Presets are {', '.join(sorted(PRESETS))}.")

    from er_il.datasets.hub import find_dataset
    from er_il.datasets.joint_paths import read_joint_paths
    from er_il.support.workers import cores

    read = read_joint_paths(find_dataset(source), wirings, cores())
    name = Path(source).resolve().name if Path(source).exists() else source
    return {each.label: (each.arm, {name: each.paths if episodes is None else each.spread(episodes)}) for each in read}


def _named(path: Path, label: str) -> Path:
    return path.with_stem(f"{path.stem}_{label}") if label else path
