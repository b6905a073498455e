"""Policies that are trained on a chunk-relative dataset get the steps that convert, whatever their type.

LeRobot's training builds a policy's pre- and post-processor from its type, or loads those of a pretrained one, and
has no room for another step. So its function is replaced in every module of this process that has imported it: with
er_il installed, the stock ``lerobot-train`` trains chunk-relative policies, and saves the steps with them. Loading
needs no replacement, only that the steps are registered.
"""

import sys
from collections.abc import Sequence
from typing import Any

from lerobot.configs import PreTrainedConfig
from lerobot.datasets import LeRobotDatasetMetadata
from lerobot.policies import factory
from lerobot.processor import (
    NormalizerProcessorStep,
    PolicyProcessorPipeline,
    ProcessorStep,
    RenameObservationsProcessorStep,
    UnnormalizerProcessorStep,
)

from er_il.datasets.schema import STATE, dimension_names
from er_il.policy.chunk_steps import AbsoluteActionsStep, RelativeActionsStep
from er_il.spaces.layout import Layout
from er_il.spaces.spec import action_spec
from er_il.support.errors import DatasetError, PolicyError

Pipelines = tuple[PolicyProcessorPipeline[Any, Any], PolicyProcessorPipeline[Any, Any]]

_STOCK = factory.make_pre_post_processors
_NAME = _STOCK.__name__


def install() -> None:
    """Let LeRobot's commands in this process make the pipelines by :func:`make_pre_post_processors`."""
    for module in list(sys.modules.values()):
        if getattr(module, "__dict__", {}).get(_NAME) is _STOCK:
            setattr(module, _NAME, make_pre_post_processors)


def make_pre_post_processors(policy_cfg: PreTrainedConfig, *args: Any, **kwargs: Any) -> Pipelines:
    """Make a policy's pipelines as LeRobot does; with the steps of chunk-relative actions, if its dataset has such.

    Raises:
        PolicyError: a policy of these settings cannot act chunk-relative, or was trained to for other actions.
    """
    pre, post = _STOCK(policy_cfg, *args, **kwargs)
    meta = getattr(policy_cfg, "_runtime_dataset_meta", None)  # of the dataset in training
    if isinstance(meta, LeRobotDatasetMetadata):
        _adapt(policy_cfg, meta, pre, post)
    if _first(pre, RelativeActionsStep):
        _check_ensembling(policy_cfg)
    return pre, post


def _adapt(
    config: PreTrainedConfig,
    meta: LeRobotDatasetMetadata,
    pre: PolicyProcessorPipeline[Any, Any],
    post: PolicyProcessorPipeline[Any, Any],
) -> None:
    """Let pipelines convert the actions of the dataset that is trained on, if they are chunk-relative."""
    spec, step = _relative_spec(meta), _first(pre, RelativeActionsStep)
    if step and step.spec != spec:
        raise PolicyError(
            "The policy was trained for other chunk-relative actions than the dataset's; train one of its own."
        )
    if spec:
        _check_chunk(config, Layout.from_spec(spec).chunk)
        if not step:
            insert_steps(config.type, pre, post, spec, dimension_names(meta.features.get(STATE, {"shape": [0]})))


def insert_steps(
    policy_type: str,
    pre: PolicyProcessorPipeline[Any, Any],
    post: PolicyProcessorPipeline[Any, Any],
    spec: dict[str, Any],
    state_names: Sequence[str],
) -> None:
    """Put the pair of steps into pipelines: where names are final and numbers are not normalised.

    Args:
        policy_type: For messages.
        pre: The policy's pre-processor.
        post: Its post-processor.
        spec: The specification of the dataset's actions.
        state_names: Names of the dataset's ``observation.state``.

    Raises:
        PolicyError: the pipelines do not normalise actions as LeRobot's others do.
        ErIlError: the state does not measure the joints.
    """
    normalise, unnormalise = _index(pre, NormalizerProcessorStep), _index(post, UnnormalizerProcessorStep)
    if normalise is None or unnormalise is None:
        raise PolicyError(
            f"Policies of the type {policy_type} normalise actions in their own way, not chunk-relative ones."
        )
    relative = RelativeActionsStep(spec=spec, state_names=list(state_names))
    renamed = _index(pre, RenameObservationsProcessorStep)
    pre.steps = _inserted(pre.steps, 0 if renamed is None else renamed + 1, relative)
    post.steps = _inserted(post.steps, unnormalise + 1, AbsoluteActionsStep(relative_step=relative))


def _relative_spec(meta: LeRobotDatasetMetadata) -> dict[str, Any] | None:
    """The specification of a dataset's actions, if they are chunk-relative."""
    try:
        spec = action_spec(meta.features)
    except DatasetError:
        return None
    return spec if "chunk" in spec else None


def _first[S: ProcessorStep](pipeline: PolicyProcessorPipeline[Any, Any], kind: type[S]) -> S | None:
    return next((step for step in pipeline.steps if isinstance(step, kind)), None)


def _check_chunk(config: PreTrainedConfig, chunk: int) -> None:
    seen = config.observation_delta_indices
    if seen is not None and seen[-1] != 0:
        raise PolicyError(
            f"Policies of the type {config.type} see future states; chunk-relative actions count from the present."
        )
    if getattr(config, "use_relative_actions", False):
        raise PolicyError("The dataset's actions are made relative by er_il: leave out --policy.use_relative_actions.")
    length = max(config.action_delta_indices or [0]) + 1
    if length > chunk:
        raise PolicyError(
            f"The policy's chunks have {length} actions, but the dataset's statistics are of chunks of {chunk}: "
            f"encode it again with --chunk {length}, or give the policy shorter chunks (--policy.chunk_size={chunk})."
        )


def _check_ensembling(config: PreTrainedConfig) -> None:
    if getattr(config, "temporal_ensemble_coeff", None) is not None:
        raise PolicyError(
            "Temporal ensembling averages actions of several chunks, which count from different states if they are "
            "chunk-relative. Switch it off, and take several actions of each chunk: "
            "--policy.temporal_ensemble_coeff=null --policy.n_action_steps=10."
        )


def _index(pipeline: PolicyProcessorPipeline[Any, Any], kind: type[ProcessorStep]) -> int | None:
    return next((i for i, step in enumerate(pipeline.steps) if isinstance(step, kind)), None)


def _inserted(steps: Sequence[ProcessorStep], index: int, step: ProcessorStep) -> list[ProcessorStep]:
    return [*steps[:index], step, *steps[index:]]
