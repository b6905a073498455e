"""The contract between a policy and a rollout: which action space, arm and frame it was trained for.

Joint and task actions have the same length, so a length cannot tell a policy that fits from one
that does not. A policy therefore declares its actions by a tag in its configuration
(``policy.tags``, which LeRobot keeps in ``config.json``), as

    er_il:<space>/<arm>/<end-effector frame>/<rotation>/<redundant joints>

for instance ``er_il:erj/panda/panda_hand_tcp/quat/panda_joint1``; a dash stands for a part that
the space does not have, a plus sign joins several joints, and what several arms have each. ERX has its weights in
the joints' place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, StrictInt, StrictStr

from er_il.arms.presets import PRESETS
from er_il.arms.robot import robot_name
from er_il.envs.decoders import Decoder, decoder
from er_il.envs.origin import CONFIG, policy_file, training_info
from er_il.envs.trust import POSTPROCESSOR, check_steps, read_processor
from er_il.kinematics.linear_coordinates import SPEC_KEY
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.base import ArmSpace
from er_il.spaces.chunk import commands_of
from er_il.spaces.layout import Layout
from er_il.spaces.registry import AND, AT, ERX, weights_text
from er_il.spaces.spec import action_spec
from er_il.support.declaration import check_values
from er_il.support.errors import DatasetError, PolicyError
from er_il.support.json_files import read_json

PREFIX = "er_il:"
NONE = "-"

# Name of the post-processing step that `er-il attach` gives a policy, to decode for a robot by itself.
DECODE_POLICY_ACTION = "er_il_decode_policy_action"
# The pair of steps of a policy that acts chunk-relative (:mod:`er_il.policy.chunk_steps`).
RELATIVE_ACTIONS, ABSOLUTE_ACTIONS = "er_il_relative_actions", "er_il_absolute_actions"


@dataclass(frozen=True)
class Contract:
    """The meaning of a policy's actions."""

    space: str
    arm: str
    frame: str
    rotation: str = NONE
    redundant: str = NONE  # joints that the action commands beside the pose, joined by +, or ERX's weights

    @classmethod
    def of_spec(cls, spec: Mapping[str, Any]) -> "Contract":
        """Return the contract of the specification of an action space, or of a layout."""
        if "arms" in spec:
            return replace(cls._of_arms(spec["arms"]), space=spec["space"])
        arm, rotation = spec["arm"], spec.get("rotation", NONE)
        if SPEC_KEY in spec:
            return cls(spec["space"], arm["name"], arm["ee_frame"], rotation, weights_text(spec[SPEC_KEY]["weights"]))
        # What a space commands beside the pose is the arm's redundant joints only if it names them.
        names = {name.rpartition(".")[0] for name in spec["names"]}  # joint.pos, or joint.delta
        commanded = [joint for joint in arm["redundant"] if joint in names]
        redundant = AND.join(commanded) if "rotation" in spec and commanded else NONE
        return cls(spec["space"], arm["name"], arm["ee_frame"], rotation, redundant)

    @classmethod
    def _of_arms(cls, arms: Sequence[Mapping[str, Any]]) -> "Contract":
        """The contract of several arms, which have an action space of one kind."""
        each = [cls.of_spec(arm) for arm in arms]
        name = robot_name({arm["label"]: one.arm for arm, one in zip(arms, each, strict=True)})
        redundant = AND.join(one.redundant for one in each if one.redundant != NONE)
        return cls(each[0].space, name, AND.join(one.frame for one in each), each[0].rotation, redundant or NONE)

    @classmethod
    def of_space(cls, space: ArmSpace | Layout) -> "Contract":
        """Return the contract that an action space, or a layout of several arms, fulfils."""
        return cls.of_spec(space.spec())

    @classmethod
    def of_tags(cls, tags: list[str] | None) -> "Contract | None":
        """Read the contract among a policy's tags, if it is there and complete."""
        for tag in tags or []:
            parts = tag.removeprefix(PREFIX).split("/")
            if tag.startswith(PREFIX) and len(parts) == len(fields(cls)):
                return cls(*parts)
        return None

    @property
    def rotation_code(self) -> str:
        """Rotation code of an environment that fulfils the contract."""
        return Quaternion.kind if self.rotation == NONE else self.rotation

    @property
    def tag(self) -> str:
        """The contract as a policy's tag."""
        return PREFIX + "/".join(getattr(self, part.name) for part in fields(self))


def policy_contract(policy: str | Path) -> Contract:
    """Find out what a policy's actions mean.

    The dataset it was trained on knows best, where it is still at hand: a tag may have been
    copied with a configuration from another arm or space.

    Args:
        policy: Folder of a pretrained policy, or its Hub id.

    Raises:
        PolicyError: the policy is missing or declares nothing.
    """
    declared = _of_dataset(policy) or Contract.of_tags(policy_tags(policy))
    if declared is None:
        raise PolicyError(
            f"The policy {policy} does not say which action space it was trained for. Train it with a tag such as "
            f"--policy.tags='[\"{Contract('erj', 'panda', 'panda_hand_tcp', 'quat', 'panda_joint1').tag}\"]', "
            "or add the tag to its config.json."
        )
    return declared


def decoder_for(name: str, contract: Contract) -> Decoder:
    """Return a decoder by its report name; ``erx`` has the weights that a policy with this contract was trained with.

    Raises:
        UnknownNameError: no decoder has that name.
    """
    chosen = decoder(name)
    alone = contract.arm in PRESETS  # several arms have the weights of their presets
    weighed = alone and chosen.space == contract.space and commands_of(chosen.space) == ERX
    return replace(chosen, space=chosen.space + AT + contract.redundant) if weighed else chosen


def check_policy(policy: str | Path, space: ArmSpace | Layout, trust: bool = False) -> None:
    """Refuse a policy whose actions are not those of ``space``, or that makes LeRobot execute what it names.

    Args:
        policy: Folder of a pretrained policy, or its Hub id.
        space: The action space, or the layout of several arms.
        trust: Accept processors with steps that are imported by their class: :mod:`er_il.envs.trust`.

    Raises:
        PolicyError: it was trained for something else, and says what differs; decodes by itself; or is not trusted.
    """
    if not trust:
        check_steps(policy)
    if decodes(policy):
        raise PolicyError(
            f"The policy {policy} decodes its actions by itself, for a robot (er-il attach). "
            "Evaluate the policy that it was made from."
        )
    got, needed = policy_contract(policy), Contract.of_space(space)
    different = [part.name for part in fields(Contract) if getattr(got, part.name) != getattr(needed, part.name)]
    if different:
        differences = ", ".join(f"{name} {getattr(got, name)!r} not {getattr(needed, name)!r}" for name in different)
        raise PolicyError(f"The policy {policy} was trained for another action space: {differences}.")


class _Shaped(BaseModel):
    type: StrictStr
    shape: tuple[Annotated[StrictInt, Field(ge=1)], ...]


class _PolicyConfig(BaseModel):
    """What er_il needs of a policy's configuration."""

    type: StrictStr
    input_features: dict[StrictStr, _Shaped] | None = None
    output_features: dict[StrictStr, _Shaped] | None = None
    tags: list[StrictStr] | None = None


def read_policy_config(policy: str | Path) -> dict[str, Any]:
    """Read the ``config.json`` of a policy, in a folder or on the Hub.

    Raises:
        PolicyError: it is missing or damaged.
    """
    path = policy_file(policy, CONFIG)
    if path is None:
        raise PolicyError(f"No policy at {policy}: it has no {CONFIG}.")
    config = read_json(path, PolicyError)
    check_values(_PolicyConfig, config, path, PolicyError)
    return config


def decodes(policy: str | Path) -> bool:
    """True if a policy decodes its actions by itself (see :mod:`er_il.robots.attachment`).

    Args:
        policy: Folder of a pretrained policy, or its Hub id.

    Raises:
        PolicyError: its post-processor is damaged, or the Hub has no such policy.
    """
    return _has_step(policy, DECODE_POLICY_ACTION)


def chunk_relative(policy: str | Path) -> bool:
    """True if a policy's processors make chunk-relative actions absolute.

    Args:
        policy: Folder of a pretrained policy, or its Hub id.

    Raises:
        PolicyError: as :func:`decodes`.
    """
    return _has_step(policy, ABSOLUTE_ACTIONS)


def _has_step(policy: str | Path, name: str) -> bool:
    path = policy_file(policy, POSTPROCESSOR)
    if path is None:
        return False  # LeRobot says what is missing
    return any(step.get("registry_name") == name for step in read_processor(path)["steps"])


def _of_dataset(policy: str | Path) -> Contract | None:
    try:
        info = training_info(policy)
        return Contract.of_spec(action_spec(info["features"])) if info else None
    except (KeyError, TypeError, AttributeError, DatasetError):
        return None  # damaged, or it does not say what its actions mean: the tag has to do


def policy_tags(policy: str | Path) -> list[str] | None:
    """Read the tags of a policy, in a folder or on the Hub.

    Raises:
        PolicyError: there is no such policy, or its configuration is damaged.
    """
    return read_policy_config(policy).get("tags")
