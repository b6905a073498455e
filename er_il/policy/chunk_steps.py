"""The pair of processor steps that make actions relative to the state for a policy, and absolute again.

LeRobot's own pair (``relative_actions_processor``) subtracts the state from the action index by index, and adds the
state of each step to the actions of a chunk that was predicted before it. This pair derives from it, because LeRobot
connects the two when it loads a policy, and keeps the raw state. It converts on SE(3), and every action of a chunk
counts from the state from which the chunk was predicted, also when the policy hands the actions out one a step.

Neither a processor nor a configuration knows when that was: a policy's queue refills by rules of its own, and LeRobot
resets policies without their processors. PyTorch knows: a chunk is predicted when a module runs between the
observation's pre-processing and the action's post-processing.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from lerobot.configs import PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, TransitionKey
from lerobot.processor import (
    AbsoluteActionsProcessorStep,
    ProcessorStepRegistry,
    RelativeActionsProcessorStep,
)
from numpy.typing import NDArray
from torch.nn.modules.module import register_module_forward_pre_hook
from torch.utils.hooks import RemovableHandle

from er_il.envs.contract import ABSOLUTE_ACTIONS, RELATIVE_ACTIONS
from er_il.spaces.layout import Layout
from er_il.spaces.relative import RelativeActions
from er_il.support.errors import PolicyError

Array = NDArray[np.float64]
Features = dict[PipelineFeatureType, dict[str, PolicyFeature]]


@ProcessorStepRegistry.register(RELATIVE_ACTIONS)
@dataclass(kw_only=True)
class RelativeActionsStep(RelativeActionsProcessorStep):
    """Makes the actions of a training batch relative to its states, before they are normalised; watches predictions.

    Attributes:
        spec: The specification of the absolute actions, from the dataset's ``features["action"]["info"]["er_il"]``.
        state_names: Names of ``observation.state``, as in the dataset.
    """

    spec: dict[str, Any]
    state_names: list[str]
    _anchor: Array | None = field(default=None, init=False, repr=False)  # (B, S) states of the latest prediction
    _age: int = field(default=0, init=False, repr=False)  # observations since then
    _watch: RemovableHandle | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        self.convert = RelativeActions(Layout.from_spec(self.spec), tuple(self.state_names))

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        transition = super().__call__(transition)  # keeps the raw state, and changes nothing
        action = transition.get(TransitionKey.ACTION)
        if action is None:
            self._age += 1
            self._await_prediction()
            return transition
        assert isinstance(action, torch.Tensor)
        relative = self.convert.relative(_chunks(action), self._states())
        return {**transition, TransitionKey.ACTION.value: _like(relative, action)}  # pyrefly: ignore[bad-typed-dict-key]

    @property
    def anchor(self) -> Array:
        """The states (B, S) from which the latest chunk was predicted.

        Raises:
            PolicyError: no prediction was seen for as long as a chunk lasts.
        """
        if self._watch is not None:  # the action was predicted before
            self._watch.remove()
        if self._anchor is None or self._age >= self.convert.layout.chunk:
            raise PolicyError(
                "It is not known from which state the policy predicted this action: no network was seen to run. "
                "Chunk-relative actions need a policy that is not compiled (torch.compile)."
            )
        return self._anchor

    def reset(self) -> None:
        self._anchor, self._age = None, 0

    def _await_prediction(self) -> None:
        """Let the state that was just seen become the anchor once a module runs."""
        if self._watch is not None:
            self._watch.remove()
        self._watch = register_module_forward_pre_hook(self._predicted)

    def _predicted(self, module: torch.nn.Module, inputs: Any) -> None:
        assert self._watch is not None
        self._watch.remove()
        self._anchor, self._age = self._states(), 0

    def _states(self) -> Array:
        """The latest states (B, S): of several in a row, which Diffusion sees, the last, at which the chunk starts."""
        state = self.get_cached_state()
        if state is None:
            raise PolicyError("There is no observation.state, from which chunk-relative actions count.")
        values = _numbers(state)
        return values[:, -1] if values.ndim == 3 else np.atleast_2d(values)

    def get_config(self) -> dict[str, Any]:
        return {"spec": self.spec, "state_names": self.state_names}

    def transform_features(self, features: Features) -> Features:
        return features


@ProcessorStepRegistry.register(ABSOLUTE_ACTIONS)
@dataclass
class AbsoluteActionsStep(AbsoluteActionsProcessorStep):
    """Makes a policy's actions absolute, after they are no longer normalised: one a row (B, E), or chunks (B, T, E).

    LeRobot connects it to the pre-processor's :class:`RelativeActionsStep`.
    """

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        action = transition.get(TransitionKey.ACTION)
        if action is None:
            return transition
        assert isinstance(action, torch.Tensor)
        step = self.relative_step
        if not isinstance(step, RelativeActionsStep):
            raise PolicyError(
                f"The policy's post-processor has the step {ABSOLUTE_ACTIONS}, but its pre-processor lacks "
                f"{RELATIVE_ACTIONS}."
            )
        absolute = step.convert.absolute(_chunks(action), step.anchor)
        return {**transition, TransitionKey.ACTION.value: _like(absolute, action)}  # pyrefly: ignore[bad-typed-dict-key]

    def get_config(self) -> dict[str, Any]:
        return {}

    def transform_features(self, features: Features) -> Features:
        return features


def _chunks(action: torch.Tensor) -> Array:
    """Actions as chunks (B, T, E), of one action each if they are single."""
    values = _numbers(action)
    return values if values.ndim == 3 else np.atleast_2d(values)[:, None]


def _numbers(tensor: torch.Tensor) -> Array:
    return tensor.detach().cpu().double().numpy()


def _like(values: Array, tensor: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(values).to(tensor).reshape(tensor.shape)
