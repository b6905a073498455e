"""The grid of an experiment: what is compared, on what, how often; all fixed before the first rollout."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

from pydantic import AliasChoices, Field, StrictBool, StrictFloat, StrictInt, StrictStr, model_validator

from er_il.arms.robot import robot_arms
from er_il.datasets.recipe import Recipe
from er_il.envs.tasks import WITHIN, takes_option, task_names
from er_il.evaluation.posture_baselines import POSTURE_BASELINES, UNSEEN_ELBOW, space_of
from er_il.support.declaration import Declaration
from er_il.support.errors import ErIlError, UnknownNameError
from er_il.support.resources import data_dir

_KIND = "act_joint_"  # a training configuration of joint space stands for those of all spaces

Count = Annotated[StrictInt, Field(ge=1)]
Seed = Annotated[StrictInt, Field(ge=0)]
Width = Annotated[StrictFloat, Field(gt=0, allow_inf_nan=False)]
Names = tuple[StrictStr, ...]


class GridError(ErIlError):
    """A grid file that is unreadable, or asks for something that cannot be."""


def check_distinct(grid: Declaration, *keys: str) -> None:
    """Refuse a grid that names a value of these keys twice."""
    for key in keys:
        values = getattr(grid, key)
        if twice := sorted({str(value) for value in values if values.count(value) > 1}):
            raise GridError(f"{key} names {', '.join(twice)} twice.")


@dataclass(frozen=True)
class Cell:
    """A task and a decoder, with policies trained on so many demonstrations, rolled out within so wide a square."""

    task: str
    decoder: str
    demonstrations: int
    within: float | None = None  # [m] side of the square in which the object starts; the task's own range if None

    @property
    def labels(self) -> dict[str, Any]:
        """What results call the cell."""
        return {name: value for name, value in vars(self).items() if value is not None}


class Grid(Declaration):
    """What an experiment compares.

    Raises:
        GridError: a value that no grid can have.
        UnknownNameError: unknown task, arm, decoder or posture baseline.
    """

    noun = "grid"
    error = GridError
    later = ("within", "joints_seen")

    title: StrictStr
    tasks: Annotated[Names, Field(min_length=1)]
    decoders: Annotated[Names, Field(min_length=1)]
    training_seeds: Annotated[tuple[Seed, ...], Field(min_length=1)]
    rollouts: Count  # of each policy through each decoder
    posture_baselines: Annotated[Names, Field(validation_alias=AliasChoices("posture_baselines", "sceptics"))] = ()
    demonstrations: Annotated[tuple[Count, ...], Field(min_length=1)] = (32,)  # to train on
    episodes: Count | None = None  # to record a task, those held out included; as many as its recipe says if None
    recording_seed: Seed = 0  # of the demonstrations
    steps: Count | None = None  # of training; as many as the space's configuration says if None
    # [m] sides of the squares in which the object starts in rollouts, whatever its range was in the demonstrations;
    # the task's own range if empty
    within: tuple[Width, ...] = ()
    joints_seen: StrictBool = True  # by policies, beside the hand; those of task-clear never see them
    introduction: StrictStr = ""  # a paragraph for the page
    arm: StrictStr = "panda"
    configuration: StrictStr = ""  # kind of training, such as images_small: configs/act_<space>_images_small.yaml
    cameras: Mapping[StrictStr, Names] = Field(default_factory=dict)  # that policies see, by task

    @model_validator(mode="after")
    def _check(self) -> Self:
        robot_arms(self.arm)  # raises if unknown
        for name in self.posture_baselines:
            if name not in POSTURE_BASELINES:
                raise UnknownNameError("posture baseline", name, POSTURE_BASELINES)
        for name in self.decoders:
            if name in POSTURE_BASELINES:
                raise GridError(f"{name} stands among the decoders; list it under posture_baselines.")
            space_of(name)  # raises if unknown
        check_distinct(self, "tasks", "decoders", "training_seeds", "demonstrations", "posture_baselines", "within")
        self._check_images()
        self._check_widths()
        for task in self.tasks:  # raises if unknown
            recipe, most = self.recipe(task), max(self.demonstrations)
            if most > (available := recipe.episodes - recipe.validation):
                raise GridError(f"demonstrations holds {most}, but the recipe of {task} has {available} to train on.")
        return self

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

    def _check_widths(self) -> None:
        if not self.within:
            return
        if len(self.demonstrations) > 1:
            raise GridError("A grid varies either demonstrations or within, not both.")
        if unplaced := [task for task in self.tasks if not takes_option(task, WITHIN)]:
            known = ", ".join(task for task in task_names() if takes_option(task, WITHIN))
            raise GridError(f"within is for tasks that place a cup: {known}; not for {', '.join(unplaced)}.")

    def recipe(self, task: str) -> Recipe:
        """Recipe of a task's demonstrations."""
        cameras = self.cameras.get(task, ())
        recipe = Recipe.load(task, self.arm).replaced(cameras=cameras, seed=self.recording_seed)
        return recipe if self.episodes is None else recipe.resized(self.episodes)

    def sees_joints(self, cell: Cell) -> bool:
        """True if the policies of a cell observe the joint angles, beside the hand."""
        return self.joints_seen and cell.decoder not in UNSEEN_ELBOW

    def seeds_of(self, cell: Cell) -> tuple[int, ...]:
        """Training seeds whose policies a cell rolls out: all, but of a posture baseline only the first."""
        return self.training_seeds[:1] if cell.decoder in POSTURE_BASELINES else self.training_seeds

    @property
    def spaces(self) -> tuple[str, ...]:
        """The action spaces of its policies."""
        return tuple(dict.fromkeys(space_of(name) for name in (*self.decoders, *self.posture_baselines)))

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The cells, task by task, the posture baselines last."""
        return tuple(
            Cell(task, name, count, width)
            for task in self.tasks
            for count in self.demonstrations
            for width in self.within or (None,)
            for name in (*self.decoders, *self.posture_baselines)
        )


def demo_grid(
    task: str, seed: int, decoders: tuple[str, ...], rollouts: int, demonstrations: int | None, steps: int | None
) -> Grid:
    """Return the grid of ``configs/demo.yaml`` with other values, which are those of ``er-il demo``.

    Raises:
        GridError: a number is too small.
        UnknownNameError: unknown task or decoder.
    """
    grid, recipe = Grid.from_file(data_dir("configs") / "demo.yaml"), Recipe.load(task)
    if demonstrations is not None:
        recipe = recipe.resized(demonstrations)
    return grid.replaced(
        title=f"{grid.title}: {task}",
        arm=recipe.arm,
        tasks=(task,),
        decoders=decoders,
        training_seeds=(seed,),
        recording_seed=seed,
        rollouts=rollouts,
        demonstrations=(recipe.episodes - recipe.validation,),
        episodes=demonstrations,
        steps=steps,
    )
