"""The recipe of a dataset: everything that decides what ``er-il generate`` records."""

from collections.abc import Iterator, Mapping
from itertools import count
from typing import Annotated, Any, Self

from pydantic import Field, StrictFloat, StrictInt, StrictStr, field_validator, model_validator

from er_il.support.declaration import Declaration
from er_il.support.errors import DatasetError, UnknownNameError
from er_il.support.resources import data_dir

# Demonstrations and evaluations must never share a seed. Evaluation counts up from 1000; a recipe's
# demos take DEMO_SEED_BASE + seed * DEMOS_PER_SEED onwards, one seed for each attempt.
DEMO_SEED_BASE = 1_000_000
DEMOS_PER_SEED = 10_000

LARGEST_DISTURBANCE = 0.1  # [rad]: more is no slip but another way

RATE = 20  # [Hz] of environments that are not asked for another one
TRAIN, VALIDATION = "train", "validation"
SUFFIX = ".yaml"


class Recipe(Declaration):
    """Declaration of a dataset: a task, the number of demonstrations, the cameras, and the randomisation of the world.

    Build it by :meth:`from_dict` or :meth:`replaced`, which refuse wrong values with a DatasetError.
    """

    noun = "recipe"
    error = DatasetError
    later = ("rate", "agent")

    task: StrictStr
    episodes: Annotated[StrictInt, Field(ge=1, le=DEMOS_PER_SEED)]  # successful demos, with those for validation
    validation: Annotated[StrictInt, Field(ge=0)]  # the last episodes, held out from training
    seed: Annotated[StrictInt, Field(ge=0)] = 0
    arm: StrictStr = "panda"
    cameras: tuple[StrictStr, ...] = ()  # recorded as videos; none: state only
    image_size: Annotated[StrictInt, Field(ge=16, multiple_of=2)] = 96  # [px] width and height; videos need it even
    # [rad] by which the follower is pushed off the leader's way (er_il.datasets.disturbance)
    disturbance: Annotated[StrictInt | StrictFloat, Field(ge=0, lt=LARGEST_DISTURBANCE)] = 0.0
    randomisation: Mapping[StrictStr, Any] = Field(default_factory=dict)  # keyword arguments of the environment
    rate: Annotated[StrictInt, Field(ge=1)] = RATE  # [Hz] of control
    agent: StrictStr = ""  # folder of the agent that demonstrates, which decides at the rate; the leader if empty

    @field_validator("cameras")
    @classmethod
    def _differ(cls, cameras: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(cameras)) != len(cameras):
            raise ValueError("A camera is named twice")
        return cameras

    @model_validator(mode="after")
    def _leaves_training_episodes(self) -> Self:
        if self.validation >= self.episodes:
            raise ValueError(
                f"{self.validation} of {self.episodes} episodes cannot be held out for validation: "
                "at least one must be left to train on"
            )
        return self

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
        return recipe if arm is None else recipe.replaced(arm=arm)

    def resized(self, episodes: int) -> "Recipe":
        """Return the recipe for another number of episodes, the same share of them held out (rounded up)."""
        share = -(-episodes * self.validation // self.episodes)
        return self.replaced(episodes=episodes, validation=max(0, min(share, episodes - 1)))

    def differences(self, other: "Recipe") -> str:
        """Name what differs from another recipe, as ``key: ours instead of theirs``; "" if nothing does."""
        ours, theirs = (each.model_dump(mode="json") for each in (self, other))
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
            **({} if self.rate == RATE else {"rate": self.rate}),
            **self.randomisation,
        }

    def demo_seeds(self) -> Iterator[int]:
        """Seeds of the demos, in the order in which they are tried."""
        return count(DEMO_SEED_BASE + self.seed * DEMOS_PER_SEED)


def recipe_names() -> tuple[str, ...]:
    """Tasks that have a shipped recipe, in alphabetical order."""
    return tuple(sorted(path.stem for path in data_dir("datasets").glob(f"*{SUFFIX}")))
