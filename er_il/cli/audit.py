"""``er-il audit``: what the elbow did in a dataset, and whether actions must say it."""

from pathlib import Path

from tyro.conf import OmitArgPrefixes, Positional

from er_il.cli.arm_options import ArmOptions

EPISODES = 20


def audit(
    dataset: Positional[str],
    *,
    robot: OmitArgPrefixes[ArmOptions],
    episodes: int = EPISODES,
    out: Path | None = None,
) -> None:
    """Say what the elbow did in a dataset, and recommend an action space for it.

    Measures how far the elbow drifts if only the hand's pose is followed, whether episodes agree about the elbow at the
    same pose, and how near each ER space comes to its folds. Writes a page with pictures.

    Args:
        dataset: Folder of the dataset, or its repository id on the hub.
        robot: The arm of a dataset that does not know it.
        episodes: Episodes to look at, spread evenly.
        out: Folder of README.md, report.json and the pictures; outputs/audit/<dataset> if omitted.
    """
    from rich.console import Console

    from er_il.cli.progress import make_progress
    from er_il.datasets.dataset import Dataset
    from er_il.datasets.hub import find_dataset
    from er_il.datasets.joint_paths import read_joint_paths
    from er_il.spaces.joint_choice import choices
    from er_il.support.atomic_files import check_writable, write_json
    from er_il.support.errors import DatasetError
    from er_il.support.provenance import provenance
    from er_il.support.workers import cores

    if episodes < 1:
        raise DatasetError(f"--episodes is {episodes}: at least one is needed.")
    target = out or Path("outputs/audit") / Path(dataset).name
    check_writable(target)
    folder = find_dataset(dataset)
    arms = read_joint_paths(folder, robot.wirings(), cores())
    for each in arms:
        choices(each.arm)  # an arm without redundancy is an error before another one is measured
    from er_il.experiments.studies.audit import study_audit  # seconds of imports: mistakes are told before
    from er_il.report.audit import recommendation, write_page

    console = Console()
    fps, name = Dataset(folder).fps, Path(dataset).name
    reports = {}
    with make_progress(console) as progress:
        for each in arms:
            bar = progress.add_task(f"Audit {each.label or each.arm.name}", total=None)
            reports[each.label] = study_audit(
                each.arm,
                each.spread(episodes),
                fps,
                cores(),
                lambda done, total, bar=bar: progress.update(bar, completed=done, total=total),
            )
    write_json(target / "report.json", {"meta": provenance() | {"dataset": dataset}, "arms": reports})
    for label, report in reports.items():
        page = write_page(target, label, report, name)
        console.print(f"{label}: " * bool(label) + recommendation(report), highlight=False, soft_wrap=True)
        console.print(str(page), highlight=False, soft_wrap=True)
