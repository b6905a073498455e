"""Picture strips: one initial state of a task through several decoders, to see why a cell is what it is."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from er_il.evaluation.recording import SUCCESS, record_rollout
from er_il.experiments.grid import Entry
from er_il.experiments.jobs import Train
from er_il.experiments.plan import Plan
from er_il.experiments.schedule import FileResult, Job
from er_il.experiments.showing import telling_seed
from er_il.report.films import Row, moments, write_strip
from er_il.report.style import label_of
from er_il.support.atomic_files import write_whole

DECODERS = ("joint", "erj", "task-nearest", "task-posture")  # as far as the grid has them
PICTURES = 5  # of a rollout
FILM_EVERY = 4  # control steps
COLOURS = 256  # of a palette: a strip of its own colours takes three times the space

NAME = "strip_{}.png"  # of a task, among the results


@dataclass(frozen=True)
class Strip(FileResult):
    """Roll one initial state out through each decoder, and show the rollouts below one another."""

    decoders: tuple[str, ...]
    policies: tuple[Train, ...]  # of each decoder
    seed: int
    path: Path

    @property
    def name(self) -> str:
        """What it does, for people."""
        return f"picture {self.policies[0].task}, start {self.seed}"

    @property
    def needs(self) -> tuple[Job, ...]:
        """The trained policies."""
        return tuple(dict.fromkeys(self.policies))

    def run(self) -> None:
        """Roll out and draw.

        Raises:
            RenderError: the machine cannot render.
        """
        rows = []
        for decoder, trained in zip(self.decoders, self.policies, strict=True):
            trace, pictures = record_rollout(trained.training.policy, trained.task, decoder, self.seed, FILM_EVERY)
            outcome = trace.outcome.replace("_", " ")
            rows.append(Row(label_of(decoder), outcome, trace.outcome == SUCCESS, moments(pictures, PICTURES)))
        write_whole(self.path, lambda path: _write(rows, path))


def _write(rows: Sequence[Row], path: Path) -> None:
    write_strip(rows, path)
    Image.open(path).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def strips(plan: Plan) -> dict[str, Strip]:
    """The strip of each task whose cells are complete, of the start that shows the difference best."""
    grid, found = plan.grid, {}
    count, training_seed = max(grid.demonstrations), grid.training_seeds[0]
    for task in grid.tasks:
        entries = [Entry(task, name, count) for name in DECODERS if name in grid.decoders]
        results = [plan.results(entry) for entry in entries]
        cells = [by_seed[training_seed] for by_seed in results if by_seed is not None]
        if entries and len(cells) == len(entries):
            policies = tuple(plan.training(entry, training_seed) for entry in entries)
            seed = telling_seed(cells)
            names = tuple(entry.decoder for entry in entries)
            path = plan.out / "strips" / f"{task}-{'-'.join(names)}-{policies[0].out.name}-start-{seed}.png"
            found[task] = Strip(names, policies, seed, path)
    return found


def copy_strips(found: dict[str, Strip], folder: Path) -> None:
    """Put the strips that are there among the results."""
    for task, strip in found.items():
        if strip.done:
            shutil.copyfile(strip.path, folder / NAME.format(task))
