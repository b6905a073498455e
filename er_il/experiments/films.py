"""Films of one initial state of each task through several decoders, and pictures of them side by side."""

import shutil
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import pandas as pd

from er_il.evaluation.recording import SUCCESS
from er_il.evaluation.trace import Trace
from er_il.experiments.grid import Cell
from er_il.experiments.jobs import Film
from er_il.experiments.plan import Plan
from er_il.report.films import Panel, write_animation, write_strip
from er_il.report.style import label_of

PICTURES = 5  # of a rollout in a strip
STRIP, ANIMATION = "strip_{}.png", "rollouts.webp"  # of a task, among the results
COLLISION = "collision"  # how the failures begin that a film shows best


def films(plan: Plan, decoders: Sequence[str]) -> dict[str, list[Film]]:
    """The films of each task whose cells with these decoders are complete."""
    grid, complete, found = plan.grid, plan.complete, {}
    count, training_seed, width = max(grid.demonstrations), grid.training_seeds[0], (*grid.within, None)[0]
    names = [name for name in decoders if name in grid.decoders]
    for task in grid.tasks if names else ():
        cells = [Cell(task, name, count, width) for name in names]
        if all(cell in complete for cell in cells):
            seed = telling_seed(plan.rollouts(*cells).query("training_seed == @training_seed"))
            trainings = [plan.training(cell, training_seed) for cell in cells]
            start = f"start-{seed}" if width is None else f"start-{seed}-within-{width:g}"
            folder = plan.out / "films" / task / f"{trainings[0].path.stem}-{start}"
            found[task] = [
                Film(
                    folder / f"{name}.npz", f"film {task} through {name} from {seed}", (trained,), 1, name, seed, width
                )
                for name, trained in zip(names, trainings, strict=True)
            ]
    return found


def telling_seed(rollouts: pd.DataFrame) -> int:
    """The first seed that shows the difference best: others succeed where task space fails, best by collision."""
    in_task_space = rollouts["decoder"].str.startswith("task")
    tells = 2 * (rollouts["success"] != in_task_space)
    tells += in_task_space & rollouts["failure"].str.startswith(COLLISION)
    return int(tells.groupby(rollouts["seed"]).sum().idxmax())


def show(task: str, of_task: Sequence[Film], folder: Path, with_films: bool) -> None:
    """Put a strip of pictures of a task's films among the results; with an animation and the films if wanted."""
    panels = [_panel(film) for film in of_task]
    write_strip(panels, PICTURES, folder / STRIP.format(task))
    if with_films:
        for path in chain.from_iterable(film.files for film in of_task):
            shutil.copy2(path, folder)
        write_animation(panels, folder / ANIMATION)


def _panel(film: Film) -> Panel:
    outcome = Trace.load(film.path).outcome
    return Panel(label_of(film.decoder), outcome.replace("_", " "), outcome == SUCCESS, film.files[0])
