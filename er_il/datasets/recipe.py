"""The recipe of a dataset: everything that decides what ``er-il generate`` records."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

from er_il.support.declaration import keys_of, read_declaration
from er_il.support.errors import DatasetError, UnknownNameError
from er_il.support.resources import data_dir

# Demonstrations and evaluations must never share a seed. Evaluation counts up from 1000; a recipe's
# demos take DEMO_SEED_BASE + seed * DEMOS_PER_SEED onwards, one seed for each attempt.
DEMO_SEED_BASE = 1_000_000
DEMOS_PER_SEED = 10_000

LARGEST_DISTURBANCE = 0.1  # [rad]: more is no slip but another way

TRAIN, VALIDATION = "train", "validation"
SUFFIX = ".yaml"


@dataclass(frozen=True)
class Recipe:
    """What to record: a task, how often, what the cameras see, and how the world varies.

    Raises:
        DatasetError: a value that no dataset can have.
    """

    task: str
    episodes: int  # successful demos, the validation episodes included
    validation: int  # the last episodes, held out from training
    seed: int = 0
    arm: str = "panda"
    cameras: tuple[str, ...] = ()  # recorded as videos; none: state only
    image_size: int = 96  # [px] width and height of every camera
    disturbance: float = 0.0  # [rad] by which the follower is pushed off the leader's way (er_il.datasets.disturbance)
    randomisation: Mapping[str, Any] = field(default_factory=dict)  # keyword arguments of the environment

    def __post_init__(self) -> None:
        if self.episodes < 1:
            raise DatasetError(f"A dataset needs at least one episode, not {self.episodes}.")
        if not 0 <= self.validation < self.episodes:
            raise DatasetError(
                f"{self.validation} of {self.episodes} episodes cannot be held out for validation: "
                "at least one must be left to train on."
            )
        if self.seed < 0:
            raise DatasetError(f"The seed is {self.seed}; it must not be negative.")
        if not 0 <= self.disturbance < LARGEST_DISTURBANCE:
            raise DatasetError(f"The disturbance is {self.disturbance}; it must be in [0, {LARGEST_DISTURBANCE}) rad.")
        if self.episodes > DEMOS_PER_SEED:
            raise DatasetError(f"A seed is good for {DEMOS_PER_SEED} demos, fewer than {self.episodes}.")
        if self.image_size < 16 or self.image_size % 2:
            raise DatasetError(
                f"The image size is {self.image_size}; videos need an even number of at least 16 pixels."
            )
        if len(set(self.cameras)) != len(self.cameras):
            raise DatasetError(f"A camera is named twice in {', '.join(self.cameras)}.")

    @classmethod
    def load(cls, task: str, arm: str | None = None) -> "Recipe":
        """Read the shipped recipe of a task, such as ``reach_cup``.

        Args:
            task: Name of the task.
            arm: Preset to record with instead of the recipe's.

        Raises:
            UnknownNameError: there is no recipe of that name.
            DatasetError: the file is no recipe.
        """
        path = data_dir("datasets") / f"{task}{SUFFIX}"
        if task not in recipe_names():
            raise UnknownNameError("task", task, recipe_names())
        recipe = cls.from_file(path)
        return recipe if arm is None else dataclasses.replace(recipe, arm=arm)

    @classmethod
    def from_file(cls, path: Path) -> "Recipe":
        """Read a recipe from a YAML (or JSON) file.

        Raises:
            DatasetError: the file is unreadable or no recipe.
        """
        return read_declaration(path, "recipe", DatasetError, cls.from_dict)

    @classmethod
    def from_dict(cls, values: object) -> "Recipe":
        """Build a recipe from plain values, such as :meth:`to_dict` gives.

        Raises:
            DatasetError: keys are missing, unknown, or of the wrong type.
        """
        values = keys_of(cls, values, "recipe", DatasetError)
        arguments = dict(values)
        arguments["cameras"] = _names(values.get("cameras", ()))
        for name, kind in [("task", str), ("arm", str), ("randomisation", Mapping)]:
            if name in values and not isinstance(values[name], kind):
                raise DatasetError(f"{name} is {values[name]!r}, not a {'mapping' if kind is Mapping else 'name'}.")
        for name in ("episodes", "validation", "seed", "image_size"):
            if name in values and (not isinstance(values[name], int) or isinstance(values[name], bool)):
                raise DatasetError(f"{name} is {values[name]!r}, not a whole number.")
        disturbance = values.get("disturbance", 0.0)
        if not isinstance(disturbance, int | float) or isinstance(disturbance, bool):
            raise DatasetError(f"disturbance is {disturbance!r}, not a number.")
        return cls(**arguments)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or YAML."""
        return dataclasses.asdict(self) | {"cameras": list(self.cameras), "randomisation": dict(self.randomisation)}

    def resized(self, episodes: int) -> "Recipe":
        """Return the recipe for another number of episodes, the same share of them held out (rounded up)."""
        share = -(-episodes * self.validation // self.episodes)
        return dataclasses.replace(self, episodes=episodes, validation=max(0, min(share, episodes - 1)))

    def differences(self, other: "Recipe") -> str:
        """Name what differs from another recipe, as ``key: ours instead of theirs``; "" if nothing does."""
        ours, theirs = self.to_dict(), other.to_dict()
        return ", ".join(f"{key} {ours[key]} instead of {theirs[key]}" for key in ours if ours[key] != theirs[key])

    @property
    def splits(self) -> dict[str, str]:
        """Ranges of episodes as LeRobot writes them: the first ones to train on, the last ones held out."""
        train = self.episodes - self.validation
        held_out = {VALIDATION: f"{train}:{self.episodes}"} if self.validation else {}
        return {TRAIN: f"0:{train}", **held_out}

    @property
    def environment(self) -> dict[str, Any]:
        """Keyword arguments for ``gymnasium.make``."""
        return {
            "arm": self.arm,
            "cameras": self.cameras,
            "image_size": self.image_size,
            **self.randomisation,
        }

    def demo_seeds(self) -> Iterator[int]:
        """Seeds of the demos, in the order in which they are tried."""
        return count(DEMO_SEED_BASE + self.seed * DEMOS_PER_SEED)


def recipe_names() -> tuple[str, ...]:
    """Tasks that have a shipped recipe, in alphabetical order."""
    return tuple(sorted(path.stem for path in data_dir("datasets").glob(f"*{SUFFIX}")))


def _names(values: object) -> tuple[str, ...]:
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise DatasetError(f"cameras is {values!r}, not a list of names.")
    return tuple(str(name) for name in values)
