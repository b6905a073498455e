"""What a dataset or a policy says of its actions: which arms they command, in which space, and how often."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from er_il.datasets.schema import dimension_names
from er_il.envs.contract import Contract, policy_tags, read_policy_config
from er_il.envs.origin import INFO, at_hand, dataset_info, training_info
from er_il.policy.training import pretrained
from er_il.spaces.chunk import commands_of
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION, action_spec
from er_il.support.errors import DatasetError, ErIlError, PolicyError, SpecError


@dataclass(frozen=True, eq=False)
class DescribedActions:
    """Actions whose meaning is known."""

    layout: Layout
    rate: float  # [Hz]


def described_actions(source: str) -> DescribedActions:
    """Read what a dataset, or the dataset that a policy was trained on, says of its actions.

    Args:
        source: Folder of a dataset, of a policy or of a training's output; or a policy's Hub id.

    Raises:
        DatasetError: the dataset does not say it.
        SpecError: what it says is damaged.
        PolicyError: there is no such policy, or its dataset is not at hand.
    """
    folder = Path(source)
    if (folder / INFO).is_file():
        return _of_info(dataset_info(folder), source)
    info = training_info(pretrained(folder) if folder.is_dir() else source)
    if info is None:
        raise PolicyError(
            f"{source} is no dataset, and no policy whose dataset is where it was in training: name the dataset."
        )
    return _of_info(info, source)


def _of_info(info: Mapping[str, Any], source: str) -> DescribedActions:
    try:
        layout = Layout.from_spec(action_spec(info["features"]))
        names, rate = dimension_names(info["features"][ACTION]), float(info["fps"])
    except (KeyError, TypeError, ValueError, DatasetError) as error:
        if isinstance(error, ErIlError):
            raise DatasetError(f"{source}: {error}") from error
        raise SpecError(f"The {INFO} of {source} is damaged: {error}.") from error
    if layout.encoded_names != names:
        raise SpecError(f"The {INFO} of {source} is damaged: its action spec names other dimensions than {names}.")
    return DescribedActions(layout, rate)


def check_policy(policy: str, layout: Layout) -> None:
    """Refuse a policy that acts otherwise than a layout's encoded vectors, as far as its files tell.

    Raises:
        PolicyError: it was trained for other actions; says which.
    """
    if not at_hand(policy):
        return
    trained_for = _trained_for(policy)
    if trained_for is not None:
        got, needed = _meaning(trained_for), _meaning(layout)
    elif (tagged := Contract.of_tags(policy_tags(policy))) and len(layout.parts) == 1:
        got = replace(tagged, space=commands_of(tagged.space)).tag  # its processors make relative actions absolute
        needed = Contract.of_space(layout.parts[0].space).tag
    else:
        got, needed = _width(policy), f"{len(layout.encoded_names)} dimensions"
    if got != needed:
        raise PolicyError(f"The policy {policy} was trained for other actions ({got}) than the robot takes ({needed}).")


def _trained_for(policy: str) -> Layout | None:
    try:
        return described_actions(policy).layout
    except ErIlError:
        return None  # its dataset is not at hand, or does not say it


def _meaning(layout: Layout) -> str:
    """What layouts share whose encoded vectors mean the same; units and order of the joints do not count."""
    spaces = (Contract.of_space(part.space).tag for part in layout.parts)
    return f"{' '.join(spaces)}: {', '.join(layout.encoded_names)}"


def _width(policy: str) -> str:
    outputs = read_policy_config(policy).get("output_features") or {}
    return f"{math.prod(outputs.get(ACTION, {}).get('shape', ()))} dimensions"
