"""The grid of an experiment with agents: which tasks, modes and seeds; all fixed before the first decision."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Self

from pydantic import Field, StrictStr, model_validator

from er_il.arms.presets import PRESETS
from er_il.envs.tasks import task_id
from er_il.experiments.grid import Count, GridError, Names, Seed, check_distinct
from er_il.rl.modes import has_controller
from er_il.support.declaration import Declaration
from er_il.support.errors import UnknownNameError

MODES = "modes"  # the key that only such grids have


@dataclass(frozen=True)
class AgentCell:
    """A task and an action mode, in an environment as it is or in a variant of it."""

    task: str
    mode: str
    variant: str = ""

    @property
    def name(self) -> str:
        """The mode with its variant."""
        return f"{self.mode} ({self.variant})" if self.variant else self.mode

    @property
    def labels(self) -> dict[str, Any]:
        """What results call the cell."""
        return {"task": self.task, "decoder": self.name}


class AgentGrid(Declaration):
    """What an experiment with agents compares.

    Raises:
        GridError: a value that no grid can have.
        UnknownNameError: unknown task, arm or mode.
    """

    noun = "grid of agents"
    error = GridError

    title: StrictStr
    tasks: Annotated[Mapping[StrictStr, Count], Field(min_length=1)]  # decisions to learn each from
    modes: Annotated[Names, Field(min_length=1)]
    training_seeds: Annotated[tuple[Seed, ...], Field(min_length=1)]
    episodes: Count = 100  # of each agent in the end, from the same starts
    introduction: StrictStr = ""  # a paragraph for the page
    arm: StrictStr = "panda"
    variants: Mapping[StrictStr, Mapping[StrictStr, Any]] = Field(default_factory=dict)  # settings of the environment

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.arm not in PRESETS:
            raise UnknownNameError("arm", self.arm, PRESETS)
        for task in self.tasks:
            task_id(task)
        for mode in self.modes:
            has_controller(mode)
        check_distinct(self, "modes", "training_seeds")
        return self

    def settings(self, variant: str) -> Mapping[str, Any]:
        """Settings of the environment in a variant."""
        return self.variants.get(variant, {})

    @property
    def cells(self) -> tuple[AgentCell, ...]:
        """The cells, task by task."""
        return tuple(
            AgentCell(task, mode, variant)
            for task in self.tasks
            for variant in self.variants or ("",)
            for mode in self.modes
        )
