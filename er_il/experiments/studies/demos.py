"""The demonstrations that a study looks at: datasets as they are, or a task's, recorded for it."""

from collections.abc import Sequence
from pathlib import Path

from rich.progress import Progress

from er_il.arms.arm import Arm
from er_il.datasets.dataset import Dataset
from er_il.datasets.joint_paths import ArmPaths, read_joint_paths
from er_il.datasets.recipe import Recipe, recipe_names
from er_il.datasets.recording import generate
from er_il.experiments.studies import Demos
from er_il.spaces.joint import JOINT
from er_il.support.errors import DatasetError, UnknownNameError


def check_demos(names: Sequence[str], episodes: int) -> None:
    """Refuse demonstrations that :func:`study_demos` would not find; the arguments are its own.

    Raises:
        UnknownNameError: a name is neither a folder nor a task.
        DatasetError: a folder is no dataset, or no demonstration is asked for.
    """
    if not names:
        raise DatasetError("Name a dataset or a task, such as reach_cup.")
    if episodes < 1:
        raise DatasetError(f"{episodes} episodes are too few: at least one is needed.")
    for name in names:
        if Path(name).is_dir():
            _ = Dataset(Path(name)).info
        elif name not in recipe_names():
            raise UnknownNameError("dataset or task", name, ["the folder of a dataset", *recipe_names()])


def study_demos(
    names: Sequence[str], episodes: int, folder: Path, progress: Progress, workers: int
) -> tuple[Arm, Demos]:
    """Read datasets of one arm, or record them.

    Args:
        names: Folders of datasets, or tasks.
        episodes: Demonstrations to record of a task; of a dataset, so many are looked at, spread evenly.
        folder: Where tasks are recorded, one folder each. What is there already is used again.
        progress: Where to show the recording.
        workers: Number of processes that record or decode.

    Returns:
        The arm, and its demonstrations by name of the task or dataset.

    Raises:
        UnknownNameError: a name is neither a folder nor a task.
        DatasetError: the datasets are of several arms, or there is none.
    """
    check_demos(names, episodes)
    found: dict[str, ArmPaths] = {}
    for name in names:
        dataset = Path(name)
        if not dataset.is_dir():
            recipe = Recipe.load(name).resized(episodes)
            dataset = generate(recipe, [JOINT], folder / name, progress, workers).paths[JOINT]
        first, *others = read_joint_paths(dataset, workers=workers)
        if others:
            raise DatasetError(f"{name} is of several arms; a study is of one. er-il advise looks at each.")
        label = dataset.parent.name if dataset.name == JOINT else dataset.name
        found[f"{label}-{len(found) + 1}" if label in found else label] = first
    arms = [paths.arm for paths in found.values()]
    if {arm.fingerprint for arm in arms} != {arms[0].fingerprint}:
        raise DatasetError(f"The datasets are of several arms: {', '.join(arm.name for arm in arms)}.")
    return arms[0], {name: each.spread(episodes) for name, each in found.items()}
