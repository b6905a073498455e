"""An agent as LeRobot knows policies: its networks, without exploration."""

from typing import Any

import gymnasium
import numpy as np
import torch
from lerobot.policies import PreTrainedPolicy
from lerobot.utils.constants import OBS_IMAGES, OBS_STATE
from stable_baselines3.sac.policies import Actor
from torch import Tensor

from er_il.envs.learning import STATE
from er_il.rl.configuration_agent import AgentConfig
from er_il.rl.controller import GOAL_NAMES, ControllerView
from er_il.rl.learner import make_actor
from er_il.rl.modes import AGENT, has_controller
from er_il.support.errors import PolicyError

_IMAGES = f"{OBS_IMAGES}."


class AgentPolicy(PreTrainedPolicy):
    """Acts by the means of what its networks would draw; through the controller, if it has one (JAiLeR)."""

    config_class = AgentConfig  # pyrefly: ignore[bad-assignment]
    name = AGENT  # pyrefly: ignore[bad-assignment]

    def __init__(self, config: AgentConfig, **_: Any) -> None:
        """Make the networks, untrained.

        Args:
            config: What the agent was trained for.
            _: What LeRobot gives to every policy.

        Raises:
            PolicyError: inputs and outputs are not those of an agent.
        """
        super().__init__(config)
        self.config: AgentConfig = config  # pyrefly: ignore[bad-override-mutable-attribute]
        config.validate_features()
        assert config.input_features is not None
        state = _vector(len(config.state_names))
        images = {
            key.removeprefix(_IMAGES): gymnasium.spaces.Box(0, 255, feature.shape, np.uint8)
            for key, feature in config.input_features.items()
            if key.startswith(_IMAGES)
        }
        self.cameras = tuple(images)
        observations = gymnasium.spaces.Dict({**images, STATE: state}) if images else state
        self._view = ControllerView(tuple(config.state_names)) if has_controller(config.mode) else None
        outputs = len(GOAL_NAMES) + 1 if self._view else len(config.action_names)
        self.actor = make_actor(observations, _shares(outputs), config.layers)
        self.controller: Actor | None = None
        if self._view:
            joints = len(config.action_names) - 1
            self.controller = make_actor(_vector(len(self._view.inputs)), _shares(joints), config.layers)

    def reset(self) -> None:
        """Begin an episode; an agent remembers nothing."""

    def select_action(self, batch: dict[str, Tensor], **_: Any) -> Tensor:
        """Actions (B, dim) in [-1, 1] for a batch of observations; images (B, 3, H, W) are in [0, 1]."""
        state = batch[OBS_STATE]
        images = {camera: batch[_IMAGES + camera] * 255.0 for camera in self.cameras}
        actions = self.actor({**images, STATE: state} if images else state, deterministic=True)
        if self._view is None or self.controller is None:
            return actions
        seen = self._view.observe(state.cpu().numpy(), actions.cpu().numpy())
        joints = self.controller(torch.from_numpy(seen).to(actions.device), deterministic=True)
        return torch.hstack([joints, actions[:, -1:]])

    @torch.inference_mode()
    def act(self, observation: Any) -> np.ndarray:
        """The action (dim,) for an observation of :class:`er_il.envs.learning.LearningEnv`."""
        state = observation[STATE] if self.cameras else observation
        batch = {OBS_STATE: torch.from_numpy(state)[None].to(self.config.device)}
        for camera in self.cameras:
            picture = torch.from_numpy(observation[camera]).permute(2, 0, 1)[None]
            batch[_IMAGES + camera] = picture.to(self.config.device).float() / 255.0
        return self.select_action(batch)[0].cpu().numpy()

    def predict_action_chunk(self, batch: dict[str, Tensor], **_: Any) -> Tensor:
        """The next action alone, as a chunk (B, 1, dim)."""
        return self.select_action(batch)[:, None]

    def forward(self, batch: dict[str, Tensor]) -> tuple[Tensor, dict[str, Any] | None]:
        """Raise a PolicyError: agents do not learn from datasets."""
        raise PolicyError("An agent learns in its environment: er-il rl train.")

    def get_optim_params(self) -> dict[str, Any]:
        """Raise a PolicyError: agents do not learn from datasets."""
        raise PolicyError("An agent learns in its environment: er-il rl train.")


def _vector(dimension: int) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-np.inf, np.inf, (dimension,), np.float32)


def _shares(dimension: int) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(-1.0, 1.0, (dimension,), np.float32)
