"""Decoding as steps of LeRobot's processor pipelines.

A policy's post-processor sees actions only, never what was measured. LeRobot itself has that
problem with actions relative to the state, and connects, on loading a policy, each
``AbsoluteActionsProcessorStep`` to the pre-processor's ``RelativeActionsProcessorStep``, which keeps
the latest raw state even where it changes nothing. :class:`DecodePolicyAction` derives from the one
to be connected to the other (see :mod:`er_il.robots.attachment`).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.lerobot_types import EnvTransition, RobotAction, TransitionKey
from lerobot.processor import AbsoluteActionsProcessorStep, ProcessorStepRegistry, RobotActionProcessorStep

from er_il.arms.arm import Vector
from er_il.control.commander import BEST_EFFORT
from er_il.envs.contract import DECODE_POLICY_ACTION
from er_il.robots.robot_commander import RobotCommander
from er_il.spaces.layout import Layout
from er_il.support.errors import ErIlError, ShapeError

Features = dict[PipelineFeatureType, dict[str, PolicyFeature]]

DECODE_ROBOT_ACTION = "er_il_decode_robot_action"


@dataclass(kw_only=True)
class _Decoding:
    """Common attributes of both steps.

    Attributes:
        spec: The specification of the actions, from the dataset's ``features["action"]["info"]["er_il"]``.
        period: Control period [s], in which the velocity limits are kept.
        on_invalid: The answer to an invalid action: ``best_effort``, ``hold`` or ``stop``.
    """

    spec: dict[str, Any]
    period: float
    on_invalid: str = BEST_EFFORT
    _commander: RobotCommander = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._commander = RobotCommander(Layout.from_spec(self.spec), self.period, self.on_invalid)

    @property
    def _layout(self) -> Layout:
        return self._commander.layout

    def get_config(self) -> dict[str, Any]:
        return {"spec": self.spec, "period": self.period, "on_invalid": self.on_invalid}

    def reset(self) -> None:
        self._commander.reset()


def measured_names(layout: Layout) -> dict[str, str]:
    """Names of a layout's dimensions in the state: dimension -> name.

    Arms say so themselves. Anything else is looked for under its own name.
    """
    names = {name: name for name in layout.other_dimensions}
    for part in layout.parts:
        names |= dict(zip(part.motors.joints, part.motors.measured, strict=True))
    return names


@ProcessorStepRegistry.register(DECODE_ROBOT_ACTION)
@dataclass(kw_only=True)
class DecodeRobotAction(_Decoding, RobotActionProcessorStep):
    """Decodes named actions to the robot's named joint positions, in its units.

    For the ``robot_action_processor`` of LeRobot's ``record`` and of teleoperation, whose teleoperator
    or earlier steps give encoded actions. The measured joints are read off the robot's observation.
    """

    def action(self, action: RobotAction) -> RobotAction:
        observation = self.transition.get(TransitionKey.OBSERVATION) or {}
        layout = self._layout
        if missing := [name for name in layout.encoded_names if name not in action]:
            raise ErIlError(f"The action lacks {', '.join(missing)}; it has {', '.join(action)}.")
        encoded = np.array([float(action[name]) for name in layout.encoded_names])
        measured = np.array([_measured(observation, measured_names(layout)[name]) for name in layout.names])  # pyrefly: ignore[bad-argument-type]
        vector = self._commander.command(encoded, measured).vector
        others = {name: value for name, value in action.items() if name not in layout.encoded_names}
        return others | dict(zip(layout.names, vector.tolist(), strict=True))

    def transform_features(self, features: Features) -> Features:
        actions = features[PipelineFeatureType.ACTION]
        others = {name: each for name, each in actions.items() if name not in self._layout.encoded_names}
        number = PolicyFeature(FeatureType.ACTION, (1,))
        return features | {PipelineFeatureType.ACTION: others | dict.fromkeys(self._layout.names, number)}


def _measured(observation: dict[str, Any], name: str) -> float:
    return float(observation.get(name, np.nan))


@ProcessorStepRegistry.register(DECODE_POLICY_ACTION)
@dataclass(kw_only=True)
class DecodePolicyAction(_Decoding, AbsoluteActionsProcessorStep):
    """Decodes a policy's actions to a robot's joint vectors, in its units: a post-processor's last step.

    A chunk of actions comes in one call, as real-time chunking has it, or in calls one after the other without a new
    observation, as from LeRobot's policy server. Its first action is decoded from the measured joints, each later one
    from where the one before it leads.

    Attributes:
        state_names: Names of ``observation.state``, as the policy was trained.
    """

    state_names: list[str]
    _state: torch.Tensor | None = field(default=None, init=False, repr=False)  # that the last action was decoded from
    _reached: Vector | None = field(default=None, init=False, repr=False)  # where it leads
    _in_chunk: bool = field(default=False, init=False, repr=False)  # it was one of several from that state

    def __post_init__(self) -> None:
        super().__post_init__()
        where = measured_names(self._layout)
        if missing := [
            where[name]
            for part in self._layout.parts
            for name in part.motors.joints
            if where[name] not in self.state_names
        ]:
            raise ErIlError(f"The state does not measure {', '.join(missing)}; it has {', '.join(self.state_names)}.")
        self._where = [
            self.state_names.index(where[name]) if where[name] in self.state_names else None
            for name in self._layout.names
        ]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the robot's values that come out."""
        return self._layout.names

    def __call__(self, transition: EnvTransition) -> EnvTransition:
        action = transition.get(TransitionKey.ACTION)
        assert isinstance(action, torch.Tensor)
        dim = len(self._layout.encoded_names)
        rows = action.detach().cpu().numpy().astype(np.float64).reshape(-1, dim)
        if action.ndim == 2 and len(rows) != 1:
            raise ShapeError("The policy's action", tuple(action.shape), f"(1, {dim}): a robot is decoded for alone")
        vectors = np.array(self._decode(rows), dtype=np.float32)
        decoded = torch.from_numpy(vectors).to(action.device).reshape(*action.shape[:-1], -1)
        return {**transition, TransitionKey.ACTION.value: decoded}  # pyrefly: ignore[bad-typed-dict-key]

    def _decode(self, rows: Vector) -> list[Vector]:
        state = self._latest_state()
        if len(rows) == 1 and state is self._state and self._reached is not None:
            measured, self._in_chunk = self._reached, True
        else:
            measured = self._measured(state)
            if self._in_chunk or len(rows) > 1:  # planned from the state, although the chunk before reached further
                self._commander.anchor(measured)
            self._state, self._in_chunk = state, len(rows) > 1
        vectors = []
        for row in rows:
            vectors.append(self._commander.command(row, measured).vector)
            measured = self._reached = vectors[-1]
        return vectors

    def reset(self) -> None:
        super().reset()
        self._state, self._reached, self._in_chunk = None, None, False

    def _latest_state(self) -> torch.Tensor:
        state = None if self.relative_step is None else self.relative_step.get_cached_state()
        if state is None:
            raise ErIlError(
                "The decoding step knows no state: the pre-processor that er-il attach wrote with it must run first."
            )
        return state

    def _measured(self, state: torch.Tensor) -> Vector:
        values = state.detach().cpu().numpy().astype(np.float64).reshape(-1)
        if len(values) != len(self.state_names):
            raise ShapeError("The state", values.shape, f"({len(self.state_names)},): {', '.join(self.state_names)}")
        return np.array([np.nan if index is None else values[index] for index in self._where])

    def get_config(self) -> dict[str, Any]:
        return super().get_config() | {"state_names": self.state_names}

    def transform_features(self, features: Features) -> Features:
        action = PolicyFeature(FeatureType.ACTION, (len(self._layout.names),))
        return features | {PipelineFeatureType.ACTION: {"action": action}}
