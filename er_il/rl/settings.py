"""The settings of an agent's training, as ``configs/sac.yaml`` has them."""

from typing import Annotated, Self

from pydantic import Field, StrictInt, model_validator

from er_il.support.declaration import Declaration
from er_il.support.errors import ErIlError
from er_il.support.resources import data_dir

Count = Annotated[StrictInt, Field(ge=1)]
Positive = Annotated[float, Field(gt=0, strict=True)]
Share = Annotated[float, Field(gt=0, le=1, strict=True)]


class SettingsError(ErIlError):
    """A file of settings that is unreadable, or says what cannot be."""


class Settings(Declaration):
    """What decides how an agent learns, beside its task and mode.

    Raises:
        SettingsError: a value that no training can have.
    """

    noun = "configuration of SAC"
    error = SettingsError

    learning_rate: Positive
    batch_size: Count
    discount: Share
    soft_update: Share  # of the critic's target, with each update
    temperature: Positive  # in the beginning
    entropy: tuple[float, float] = (-1.0, -1.0)  # aimed at, of an action's dimension: in the first half, at the end
    warm_up: Annotated[StrictInt, Field(ge=0)]  # random decisions in the beginning
    environments: Count
    episode: Count  # decisions of one to learn from; to be judged, an agent has the task's time
    updates: Count  # with each decision of all environments
    buffer: Count  # transitions
    layers: Annotated[tuple[Count, ...], Field(min_length=1)]  # widths, of actor and critics alike
    reward_scale: Positive
    n_steps: Count = 1  # decisions whose rewards an update adds up before it asks the critic; only from states
    milestone: Count  # decisions between evaluations, each with a checkpoint
    evaluations: Count  # episodes of such an evaluation
    shift: Annotated[StrictInt, Field(ge=0)] = 0  # [px] of images in training

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.buffer < self.batch_size:
            raise SettingsError(f"A buffer of {self.buffer} transitions holds no batch of {self.batch_size}.")
        return self

    @classmethod
    def shipped(cls, pixels: bool) -> "Settings":
        """The settings that come with er_il, for training from states or from images."""
        return cls.from_file(data_dir("configs") / ("sac_pixels.yaml" if pixels else "sac.yaml"))
