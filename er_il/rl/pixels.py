"""Features of images and state, with the random shifts of DrQ (Kostrikov et al. 2021, arXiv 2004.13649) in training."""

from collections.abc import Sequence

import gymnasium
import torch
from stable_baselines3.common.torch_layers import CombinedExtractor
from torch.nn import functional

from er_il.envs.learning import STATE
from er_il.rl.scaling import ScaledExtractor


class ShiftedExtractor(CombinedExtractor):
    """Stable-Baselines3's networks for images and vectors; in training each image is shifted by a few pixels."""

    def __init__(self, observation_space: gymnasium.spaces.Dict, scale: Sequence[float], shift: int) -> None:
        """Prepare for shifts of up to ``shift`` pixels along each axis, and for states multiplied by ``scale``."""
        super().__init__(observation_space)
        state = observation_space[STATE]
        assert isinstance(state, gymnasium.spaces.Box)
        self.extractors[STATE] = ScaledExtractor(state, scale)
        self._shift = shift

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        if self.training and self._shift:
            observations = {
                key: shifted(value, self._shift) if value.ndim == 4 else value for key, value in observations.items()
            }
        return super().forward(observations)


def shifted(images: torch.Tensor, most: int) -> torch.Tensor:
    """Shift each of images (N, C, H, W) by up to ``most`` pixels along each axis, its border repeated."""
    count, channels, height, width = images.shape
    padded = functional.pad(images, (most,) * 4, mode="replicate")
    top, left = torch.randint(0, 2 * most + 1, (2, count, 1), device=images.device)
    rows = (top + torch.arange(height, device=images.device))[:, None, :, None]
    columns = (left + torch.arange(width, device=images.device))[:, None, None, :]
    image = torch.arange(count, device=images.device)[:, None, None, None]
    channel = torch.arange(channels, device=images.device)[None, :, None, None]
    return padded[image, channel, rows, columns]
