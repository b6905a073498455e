"""Films of one initial state of each task through several decoders, and pictures of them side by side."""

import shutil
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import av
import numpy as np
import pandas as pd
from PIL import Image

from er_il.evaluation.recording import SUCCESS, Picture
from er_il.evaluation.trace import Trace
from er_il.experiments.grid import Cell
from er_il.experiments.jobs import Film
from er_il.experiments.plan import Plan
from er_il.report.films import Panel, Row, moments, write_animation, write_strip
from er_il.report.style import label_of
from er_il.support.atomic_files import write_atomically

PICTURES = 5  # of a rollout in a strip
COLOURS = 256  # of a palette: a strip of its own colours takes three times the space
STRIP, ANIMATION = "strip_{}.png", "rollouts.webp"  # of a task, among the results
COLLISION = "collision"  # how the failures begin that a film shows best


def films(plan: Plan, decoders: Sequence[str]) -> dict[str, list[Film]]:
    """The films of each task whose cells with these decoders are complete."""
    grid, complete, found = plan.grid, plan.complete, {}
    count, training_seed = max(grid.demonstrations), grid.training_seeds[0]
    for task in grid.tasks:
        cells = [Cell(task, name, count) for name in decoders if name in grid.decoders]
        if cells and all(cell in complete for cell in cells):
            seed = telling_seed(plan.rollouts(*cells).query("training_seed == @training_seed"))
            trainings = [plan.training(cell, training_seed) for cell in cells]
            folder = plan.out / "films" / task / f"{trainings[0].out.name}-start-{seed}"
            pairs = zip(cells, trainings, strict=True)
            found[task] = [Film(trained, cell.decoder, seed, folder / f"{cell.decoder}.npz") for cell, trained in pairs]
    return found


def telling_seed(rollouts: pd.DataFrame) -> int:
    """The first seed that shows the difference best: others succeed where task space fails, best by collision."""
    in_task_space = rollouts["decoder"].str.startswith("task")
    tells = 2 * (rollouts["success"] != in_task_space)
    tells += in_task_space & rollouts["failure"].str.startswith(COLLISION)
    return int(tells.groupby(rollouts["seed"]).sum().idxmax())  # pyright: ignore[reportArgumentType]


def show_strip(of_task: Sequence[Film], folder: Path) -> None:
    """Put a strip of pictures of a task's films among the results."""
    rows = [
        Row(label_of(film.decoder), outcome, success, moments(_pictures(film.film), PICTURES))
        for film in of_task
        for outcome, success in [_outcome(film)]
    ]
    write_atomically(folder / STRIP.format(of_task[0].trained.task), lambda path: _write_strip(rows, path))


def show_films(of_task: Sequence[Film], folder: Path) -> None:
    """Put a task's films themselves among the results, with an animation of them side by side."""
    for film in of_task:
        for path in film.files:
            shutil.copy2(path, folder)
    write_animation([Panel(label_of(film.decoder), *_outcome(film), film.film) for film in of_task], folder / ANIMATION)


def _write_strip(rows: Sequence[Row], path: Path) -> None:
    write_strip(rows, path)
    Image.open(path).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def _outcome(film: Film) -> tuple[str, bool]:
    """Outcome of a filmed rollout for people, and whether it is success."""
    outcome = Trace.load(film.path).outcome
    return outcome.replace("_", " "), outcome == SUCCESS


def _pictures(film: Path) -> list[Picture]:
    with closing(av.open(str(film))) as container:
        return [np.array(frame.to_image()) for frame in container.decode(container.streams.video[0])]
