"""Training configurations: those that ship, and what they let a policy see."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, StrictInt, StrictStr

from er_il.datasets.schema import IMAGES
from er_il.spaces.registry import AT, split_name
from er_il.support.declaration import check_values, read_yaml
from er_il.support.errors import PolicyError
from er_il.support.resources import data_dir


def default_config(space: str, kind: str = "") -> Path:
    """Return the configuration that ships for a space: from states, or another kind, such as ``images_small``."""
    suffix = f"_{kind}" if kind else ""
    return data_dir("configs") / f"act_{split_name(space)[0].partition(AT)[0]}{suffix}.yaml"


class _Input(BaseModel):
    type: StrictStr
    shape: tuple[StrictInt, ...]


class _Policy(BaseModel):
    input_features: dict[StrictStr, _Input] | None = None


class _Configuration(BaseModel):
    """What er_il needs of a configuration; LeRobot reads, and checks, the rest."""

    steps: Annotated[StrictInt, Field(ge=1)] | None = None
    policy: _Policy | None = None


def read_config(config: Path) -> dict[str, Any]:
    """Read a training configuration.

    Raises:
        PolicyError: it is missing or damaged.
    """
    values = read_yaml(config, "training configuration", PolicyError)
    check_values(_Configuration, values, config, PolicyError)
    assert isinstance(values, dict)
    return values


def default_steps(config: Path) -> int:
    """Return the number of steps that a configuration asks for.

    Raises:
        PolicyError: the configuration is missing or damaged, or does not say.
    """
    steps = read_config(config).get("steps")
    if steps is None:
        raise PolicyError(f"{config} does not say how many steps to take.")
    return steps


def input_features(config: Path, features: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what a policy sees of a dataset: the inputs that a configuration names, in the dataset's own shapes.

    A configuration holds the shapes of the cup tasks on an arm with seven joints. Where it names a camera, all
    cameras of the dataset take its place. Empty if it names nothing: LeRobot then takes all there is.

    Args:
        config: Configuration of the training.
        features: The dataset's features, as in its ``info.json``.

    Raises:
        PolicyError: the dataset lacks an input, or has no camera where the configuration has one.
    """
    named = named_inputs(config)
    inputs = {key: feature for key, feature in named.items() if not key.startswith(IMAGES)}
    if missing := [key for key in inputs if key not in features]:
        raise PolicyError(f"{config} wants {', '.join(missing)}, which the dataset does not have.")
    shapes = {key: features[key]["shape"] for key in inputs}
    if len(inputs) < len(named):
        cameras = {key: feature["shape"] for key, feature in features.items() if key.startswith(IMAGES)}
        if not cameras:
            raise PolicyError(f"{config} is for images; the dataset has none. Record it with --cameras.")
        inputs |= {key: {"type": "VISUAL"} for key in cameras}
        shapes |= {key: [channels, height, width] for key, (height, width, channels) in cameras.items()}
    return {key: {"type": feature["type"], "shape": list(shapes[key])} for key, feature in inputs.items()}


def named_inputs(config: Path) -> dict[str, dict[str, Any]]:
    """The inputs that a configuration names; empty if it leaves them to LeRobot."""
    return (read_config(config).get("policy") or {}).get("input_features") or {}
