"""The grid of a benchmark: what is compared, on what, how often; all fixed before the first rollout."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from er_il.arms.arm import Arm
from er_il.datasets.recipe import Recipe
from er_il.envs.tasks import task_id
from er_il.evaluation.posture_baselines import SCEPTICS, space_of
from er_il.support.declaration import keys_of, read_declaration
from er_il.support.errors import ErIlError, UnknownNameError
from er_il.support.resources import data_dir


class GridError(ErIlError):
    """A grid file that is unreadable, or asks for something that cannot be."""


@dataclass(frozen=True)
class Entry:
    """One cell: a task and a decoder, with policies trained on so many demonstrations."""

    task: str
    decoder: str
    demonstrations: int


@dataclass(frozen=True)
class Grid:
    """What a benchmark compares.

    Raises:
        GridError: a value that no grid can have.
        UnknownNameError: unknown task, arm, decoder or sceptic's decoder.
    """

    title: str
    tasks: tuple[str, ...]
    decoders: tuple[str, ...]
    training_seeds: tuple[int, ...]
    rollouts: int  # of each policy through each decoder
    sceptics: tuple[str, ...] = ()  # decoders of task space with a posture from the demonstrations
    demonstrations: tuple[int, ...] = (32,)  # to train on
    episodes: int | None = None  # to record a task, those held out included; as many as its recipe says if None
    steps: int | None = None  # of training; as many as the space's configuration says if None
    introduction: str = ""  # a paragraph for the page
    arm: str = "panda"
    configuration: str = ""  # kind of training, such as images_small: configs/act_<space>_images_small.yaml
    cameras: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)  # that policies see, by task

    def __post_init__(self) -> None:
        for task in self.tasks:
            task_id(task)  # raises if unknown
        Arm.preset(self.arm)  # raises if unknown
        for name in self.sceptics:
            if name not in SCEPTICS:
                raise UnknownNameError("sceptic's decoder", name, SCEPTICS)
        for name in self.decoders:
            if name in SCEPTICS:
                raise GridError(f"{name} stands among the decoders; list it under sceptics.")
            space_of(name)  # raises if unknown
        for key in ("tasks", "decoders", "training_seeds", "demonstrations"):
            if not getattr(self, key):
                raise GridError(f"{key} is empty; name at least one.")
        for key in ("tasks", "decoders", "training_seeds", "demonstrations", "sceptics"):
            values = getattr(self, key)
            if twice := sorted({str(value) for value in values if values.count(value) > 1}):
                raise GridError(f"{key} names {', '.join(twice)} twice.")
        numbers: dict[str, tuple[int, ...]] = {"rollouts": (self.rollouts,), "demonstrations": self.demonstrations}
        numbers |= {key: (value,) for key in _OPTIONAL if (value := getattr(self, key)) is not None}
        for key, values in numbers.items():
            if min(values) < 1:
                raise GridError(f"{key} is {min(values)}; it must be at least 1.")
        if min(self.training_seeds) < 0:
            raise GridError(f"training_seeds holds {min(self.training_seeds)}; seeds must not be negative.")
        self._check_images()
        for task in self.tasks:
            recipe = self.recipe(task)
            available = recipe.episodes - recipe.validation
            if max(self.demonstrations) > available:
                raise GridError(
                    f"demonstrations holds {max(self.demonstrations)}, "
                    f"but the recipe of {task} has {available} to train on."
                )

    def _check_images(self) -> None:
        kinds = sorted(path.stem.removeprefix(_KIND) for path in data_dir("configs").glob(f"{_KIND}*.yaml"))
        if self.configuration and self.configuration not in kinds:
            raise UnknownNameError("configuration", self.configuration, kinds)
        if strangers := sorted(set(self.cameras) - set(self.tasks)):
            raise GridError(f"cameras names {', '.join(strangers)}, which the grid does not have among its tasks.")
        blind = [task for task in self.tasks if not self.cameras.get(task)]
        if (self.configuration or self.cameras) and (blind or not self.configuration):
            missing = f"the cameras of {', '.join(blind)}" if blind else f"configuration, one of {', '.join(kinds)}"
            raise GridError(f"To learn from images, a grid needs configuration and cameras; it lacks {missing}.")

    def recipe(self, task: str) -> Recipe:
        """What is recorded of a task."""
        recipe = Recipe.load(task, self.arm).replaced(cameras=self.cameras.get(task, ()))
        return recipe if self.episodes is None else recipe.resized(self.episodes)

    def seeds_of(self, entry: Entry) -> tuple[int, ...]:
        """Training seeds whose policies an entry rolls out: all, but for sceptics' decoders only the first."""
        return self.training_seeds[:1] if entry.decoder in SCEPTICS else self.training_seeds

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The cells, task by task, the sceptics' ones last."""
        return tuple(
            Entry(task, name, count)
            for task in self.tasks
            for count in self.demonstrations
            for name in (*self.decoders, *self.sceptics)
        )

    @classmethod
    def from_file(cls, path: Path) -> "Grid":
        """Read a grid from a YAML file.

        Raises:
            GridError: the file is unreadable or no grid.
        """
        return read_declaration(path, "grid", GridError, cls.from_dict)

    @classmethod
    def from_dict(cls, values: object) -> "Grid":
        """Build a grid from plain values, such as :meth:`to_dict` gives.

        Raises:
            GridError: keys are missing, unknown, or of the wrong type.
        """
        return cls(**{key: _value(key, value) for key, value in keys_of(cls, values, "grid", GridError).items()})

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON or YAML."""
        values = dataclasses.asdict(self) | {"cameras": {task: list(names) for task, names in self.cameras.items()}}
        return {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}


_KIND = "act_joint_"  # a training configuration of joint space stands for those of all spaces
_TEXTS, _NAMES = ("title", "introduction", "arm", "configuration"), ("tasks", "decoders", "sceptics")
_NUMBERS, _OPTIONAL = ("training_seeds", "demonstrations"), ("episodes", "steps")


def _value(key: str, value: Any) -> Any:
    """Check a value's type; lists become tuples."""
    if key in _TEXTS:
        if not isinstance(value, str):
            raise GridError(f"{key} is {value!r}, not a text.")
        return value
    if key == "cameras":
        if not isinstance(value, dict) or not all(isinstance(names, list) for names in value.values()):
            raise GridError(f"{key} is {value!r}, not a list of cameras for each task.")
        return {task: tuple(map(str, names)) for task, names in value.items()}
    if key in _NAMES or key in _NUMBERS:
        kind, what = (str, "names") if key in _NAMES else (int, "whole numbers")
        if not isinstance(value, list) or not all(isinstance(each, kind) and each is not True for each in value):
            raise GridError(f"{key} is {value!r}, not a list of {what}.")
        return tuple(value)
    if not (isinstance(value, int) and not isinstance(value, bool)) and not (key in _OPTIONAL and value is None):
        raise GridError(f"{key} is {value!r}, not a whole number.")
    return value
