"""What a reader of the demo sees: films, a strip, recordings and a page, from results already there."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.progress import Progress

from er_il.evaluation.recording import SUCCESS, record_rollout
from er_il.evaluation.results import write_cells
from er_il.evaluation.rollouts import Cell
from er_il.experiments.schedule import Executor
from er_il.report.demo_page import write_page
from er_il.report.films import Panel, Picture, Row, moments, write_animation, write_film, write_strip
from er_il.report.style import label_of
from er_il.support.provenance import provenance

FILM_EVERY = 2  # control steps a picture: shadows make each expensive
MOMENTS = 5  # pictures of a rollout in the strip
STRIP, ANIMATION = "strip.png", "rollouts.webp"
COLLISION = "collision"  # how the failures begin that a film shows best


def telling_seed(cells: Sequence[Cell]) -> int:
    """The first seed that shows the difference best: others succeed where task space fails, best by collision."""

    def tells(index: int) -> int:
        outcomes = [(cell.decoder.startswith("task"), cell.episodes[index]) for cell in cells]
        return sum(
            2 * (episode.success != task) + (task and episode.failure.startswith(COLLISION))
            for task, episode in outcomes
        )

    return cells[0].episodes[max(range(len(cells[0].episodes)), key=tells)].seed


def film_rollouts(
    executor: Executor,
    progress: Progress,
    policies: Mapping[str, Path],
    task: str,
    seed: int,
    folder: Path,
) -> dict[str, str]:
    """Film one rollout a decoder on the same seed, and show them side by side; what is there is not filmed again.

    Args:
        executor: Where the rollouts run.
        progress: Where to show progress.
        policies: Decoder's name to its policy.
        task: Name of the task.
        seed: Seed of the initial state.
        folder: Where ``<decoder>.mp4``, ``.rrd`` and ``.npz``, the animation and the strip go.

    Returns:
        Caption to file name, relative to the folder.
    """
    captions = {
        f"The same start (seed {seed}) through each decoder": ANIMATION,
        "The same from start to end": STRIP,
    }
    for name in policies:
        captions[f"Film, {name}"] = f"{name}.mp4"
        captions[f"Rerun recording, {name}"] = f"{name}.rrd"
    if all((folder / file).exists() for file in captions.values()):
        return captions
    jobs = [executor.submit(_film, policy, task, name, seed, folder) for name, policy in policies.items()]
    rows = [job.result() for job in progress.track(jobs, description="Film a rollout each")]
    write_strip(rows, folder / STRIP)
    panels = [
        Panel(label_of(name), row.outcome.replace("_", " "), row.success, folder / f"{name}.mp4")
        for name, row in zip(policies, rows, strict=True)
    ]
    write_animation(panels, folder / ANIMATION)
    return captions


def write_report(
    cells: Sequence[Cell], meta: Mapping[str, Any], folder: Path, introduction: str, pictures: Mapping[str, str]
) -> None:
    """Write the JSON, the CSV, the chart and the page."""
    write_cells(cells, provenance() | dict(meta), folder)
    write_page(folder, f"er_il demo: {cells[0].task}", introduction, pictures)


def _film(policy: Path, task: str, name: str, seed: int, folder: Path) -> Row:
    from er_il.viewer import save_rollout

    trace, pictures = record_rollout(policy, task, name, seed, FILM_EVERY)
    write_film(pictures, folder / f"{name}.mp4", round(1 / trace.period / FILM_EVERY))
    trace.save(folder / f"{name}.npz")
    save_rollout(trace, folder / f"{name}.rrd")
    shown: list[Picture] = moments(pictures, MOMENTS)
    return Row(name, trace.outcome, trace.outcome == SUCCESS, shown)
