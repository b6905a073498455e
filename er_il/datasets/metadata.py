"""What er_il and LeRobot need of the ``meta/info.json`` of a LeRobot v3 dataset, as classes to check it against."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, Field, StrictFloat, StrictInt, StrictStr, model_validator

from er_il.spaces.spec import ACTION

Name = StrictStr | StrictInt
Positive = Annotated[StrictInt, Field(ge=1)]


class FeatureInfo(BaseModel):
    """A column; its names are a list, or lists in a list, or a mapping of lists or numbers in older datasets."""

    dtype: Annotated[StrictStr, Field(pattern=r"^(video|image|string|language|bool|u?int\d+|float\d+)$")]
    shape: Annotated[tuple[Positive, ...], Field(min_length=1)]
    names: list[Name | list[Name]] | Mapping[StrictStr, list[Name] | StrictInt] | None = None
    info: Mapping[StrictStr, Any] | None = None


class DatasetInfo(BaseModel):
    """The whole file."""

    codebase_version: StrictStr
    fps: Annotated[StrictInt | StrictFloat, Field(gt=0, allow_inf_nan=False)]
    features: dict[StrictStr, FeatureInfo]
    total_frames: Annotated[StrictInt, Field(ge=0)]
    total_episodes: Annotated[StrictInt, Field(ge=0)]
    total_tasks: Annotated[StrictInt, Field(ge=0)] = 0
    chunks_size: Positive = 1
    data_files_size_in_mb: Positive = 1
    video_files_size_in_mb: Positive = 1
    data_path: StrictStr = ""
    video_path: StrictStr | None = None
    robot_type: StrictStr | None = None
    splits: dict[StrictStr, StrictStr] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _numeric_action(self) -> "DatasetInfo":
        action = self.features.get(ACTION)
        if action is not None and not action.dtype.startswith(("float", "int")):
            raise ValueError(f"The {ACTION}s are of the type {action.dtype!r}, which is none of numbers")
        return self
