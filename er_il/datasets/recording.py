"""Generating datasets: demos are recorded once and written as one LeRobot v3 dataset a space."""

import errno
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from rich.progress import Progress

from er_il.arms.arm import Weights
from er_il.arms.robot import robot_arms
from er_il.datasets.dataset import Dataset, datasets_in
from er_il.datasets.demos import LEADER, Demo, Demonstrator, collect, demo_path, make_world
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import DatasetRecord
from er_il.kinematics.linear_coordinates import SPEC_KEY
from er_il.spaces.chunk import CHUNK, chunk_of
from er_il.spaces.layout import Layout
from er_il.spaces.registry import check_space, make_arm_space
from er_il.support.atomic_files import PARTIAL, work_folder, write_json
from er_il.support.errors import DatasetError

_DEMOS, _DATASET, _RECIPE = "demos", "dataset", "recipe.json"  # in the folder of an unfinished run


@dataclass(frozen=True)
class Generated:
    """The datasets of one recipe."""

    paths: dict[str, Path]  # space -> dataset, as asked for
    new: tuple[str, ...]  # spaces that this call wrote; empty if all were there
    dropped: dict[int, str]  # demo seed -> why it is not in the datasets


def generate(
    recipe: Recipe,
    spaces: Sequence[str],
    out: Path,
    progress: Progress,
    workers: int,
    weights: Mapping[str, Weights] = MappingProxyType({}),
    chunk: int = CHUNK,
    demonstrator: Demonstrator = LEADER,
) -> Generated:
    """Record a recipe's demos and write one dataset a space into ``out``.

    Interrupted at any point, the same call resumes, one process at a time. Datasets that exist are left
    alone; only what is missing is added.

    Args:
        recipe: What to record.
        spaces: Kinds of action space; they name the datasets' folders.
        out: Folder of the datasets. Finished demos wait beside it, in ``<out>.partial``.
        progress: Where to show progress.
        workers: Number of worker processes.
        weights: Of ERX (n-6, n), by the arm's label; those of the arms where it says nothing.
        chunk: Number of actions of a chunk, in the chunk-relative spaces.
        demonstrator: Who demonstrates.

    Raises:
        UnknownNameError: unknown task, space, arm or camera.
        ArmError: the arm has no such space, or other joints than the weights.
        DatasetError: another recipe's data is there, or other weights', most demos fail, or the folder cannot be
            written.
        ErIlError: another process writes there.
    """
    asked, layouts = tuple(dict.fromkeys(spaces)), {}
    arms = robot_arms(recipe.arm)
    arms = {**arms, **{label: arms[label].weighing(rows) for label, rows in weights.items()}}
    for space in asked or ("",):
        check_space(space)
        own = {label: make_arm_space(space, arm) for label, arm in arms.items()}
        layouts[space] = Layout.of_spaces(own, chunk_of(space, chunk))
    with _writing_to(out), work_folder(out) as work:
        there = {path.name for path in datasets_in(out)} | {space for space in asked if (out / space).exists()}
        for space in sorted(there):
            _check_same(recipe, DatasetRecord.read(out / space).recipe, out / space)
            if space in layouts:
                _check_encoding(layouts[space], out / space)
        new = tuple(space for space in asked if space not in there)
        first = out / min(there, default=asked[0])
        if not there:
            _record(recipe, layouts[first.name], first, work, progress, workers, demonstrator)
        if missing := {space: layouts[space] for space in new if out / space != first}:
            _encode(Dataset(first), out, missing, progress)
        for leftover in (work / _DEMOS, work / _DATASET):
            shutil.rmtree(leftover, ignore_errors=True)
        for file in (work / _RECIPE, *work.glob(f"*{PARTIAL}-*")):  # the latter of a run killed as it wrote the former
            file.unlink(missing_ok=True)
    return Generated({space: out / space for space in asked}, new, DatasetRecord.read(first).dropped)


def _record(
    recipe: Recipe,
    layout: Layout,
    target: Path,
    work: Path,
    progress: Progress,
    workers: int,
    demonstrator: Demonstrator,
) -> None:
    """Collect the demos and write the first dataset from them."""
    world = make_world(recipe)
    try:
        world.reset(seed=0)  # what cannot be rendered shows here, not in a worker
        demos = _claim(work, recipe)
        from er_il.datasets.writer import Writer  # LeRobot: seconds of imports; mistakes are told before

        dropped: dict[int, str] = {}
        writer = Writer(recipe, world, layout, work / _DATASET)
        bar = progress.add_task(f"Record {recipe.task}", total=recipe.episodes)
        for seed, reason in collect(recipe, demos, workers, demonstrator):
            if reason:
                dropped[seed] = reason
                progress.update(bar, description=f"Record {recipe.task} ({len(dropped)} dropped)")
            else:
                writer.add(Demo.load(demo_path(demos, seed)))
                progress.advance(bar)
        writer.finish(dropped)
    finally:
        world.close()
    target.parent.mkdir(parents=True, exist_ok=True)
    (work / _DATASET).rename(target)


def _encode(first: Dataset, out: Path, layouts: Mapping[str, Layout], progress: Progress) -> None:
    """Write the first dataset again in other spaces."""
    from lerobot.utils.utils import SuppressProgressBars

    from er_il.datasets.encoding import encode_dataset

    with SuppressProgressBars():
        for space in progress.track(layouts, description="Encode in the other spaces"):
            encode_dataset(first, out / space, layouts[space])


def _claim(work: Path, recipe: Recipe) -> Path:
    """Return the folder of finished demos, which belongs to one recipe."""
    demos, owner = work / _DEMOS, work / _RECIPE
    if owner.exists():
        _check_same(recipe, Recipe.from_file(owner), work)
    demos.mkdir(exist_ok=True)
    write_json(owner, recipe.to_dict())
    return demos


def _check_same(asked: Recipe, found: Recipe, where: Path) -> None:
    if difference := asked.differences(found):
        raise DatasetError(
            f"{where} holds another recipe's data; asked for is {difference}. Choose another --out, or delete it."
        )


def _check_encoding(asked: Layout, dataset: Path) -> None:
    found = Dataset(dataset).spec
    if asked.spec().get("chunk") != found.get("chunk"):
        raise DatasetError(f"{dataset} has chunks of {found.get('chunk')} actions; choose another --out.")
    if _weights(asked.spec()) != _weights(found):
        raise DatasetError(f"{dataset} has other weights of its linear coordinates; choose another --out.")


@contextmanager
def _writing_to(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else error
        raise DatasetError(f"Cannot write to {out}: {reason}.") from error
    except RuntimeError as error:
        full = os.strerror(errno.ENOSPC)
        if full not in str(error):  # all that LeRobot's encoder threads pass on is the text
            raise
        raise DatasetError(f"Cannot write to {out}: {full}.") from error


def _weights(spec: Mapping[str, Any]) -> list[Any]:
    """What the specification of a layout says of ERX's weights, arm by arm."""
    return [arm.get(SPEC_KEY) for arm in spec.get("arms", [spec])]
