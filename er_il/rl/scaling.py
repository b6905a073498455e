"""What an agent's networks see of the state: small distances, enlarged to the size of its other dimensions.

What is left to a goal or a command is some centimetres or hundredths of a radian; beside joint angles, networks would
hardly see it.
"""

from collections.abc import Sequence

import torch
from gymnasium.spaces import Box
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from er_il.envs.learning_state import WAY_NAMES

SMALL = (*WAY_NAMES, "left")  # endings of the names of dimensions that vanish at a goal
ENLARGED = 10.0  # so that 0.1 m, and 0.1 rad, are 1


def state_scale(names: Sequence[str]) -> list[float]:
    """Factors of the state's dimensions, by their names (:class:`er_il.envs.learning_state.LearningState`)."""
    return [ENLARGED if name.rpartition(".")[2] in SMALL else 1.0 for name in names]


class ScaledExtractor(BaseFeaturesExtractor):
    """Multiplies a state by factors, which are saved with the network's weights."""

    scale: torch.Tensor

    def __init__(self, observation_space: Box, scale: Sequence[float] = ()) -> None:
        """Multiply by ``scale``, one factor for each dimension; by 1 if it is empty, before weights are loaded."""
        dimension = observation_space.shape[0]
        super().__init__(observation_space, dimension)
        self.register_buffer("scale", torch.tensor(scale or [1.0] * dimension, dtype=torch.float32))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return observations * self.scale
