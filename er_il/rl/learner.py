"""Stable-Baselines3's SAC with er_il's settings, and networks of an actor alone."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import SAC
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.sac.policies import Actor, SACPolicy
from torch.distributions import Distribution
from torch.nn import functional

from er_il.rl.pixels import ShiftedExtractor
from er_il.rl.scaling import ScaledExtractor, state_scale
from er_il.rl.settings import Settings, SettingsError


class NormedReLU(torch.nn.Module):
    """ReLU of a normalised layer: critics do not grow without bound where no data is (Ball et al. 2023, RLPD)."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return functional.relu(functional.layer_norm(x, x.shape[-1:]))


def make_sac(envs: VecEnv, names: Sequence[str], settings: Settings, seed: int) -> SAC:
    """SAC for environments side by side.

    Args:
        envs: Where it is to learn.
        names: Of the state's dimensions.
        settings: How.
        seed: Of its networks and actions; also seeds the global generators of torch and NumPy, which it draws from.

    Raises:
        SettingsError: returns of several decisions from images, which Stable-Baselines3 does not have.
    """
    images = isinstance(envs.observation_space, gymnasium.spaces.Dict)
    if images and settings.n_steps > 1:
        raise SettingsError("From images, Stable-Baselines3 has no n-step returns: n_steps must be 1.")
    return SAC(
        "MultiInputPolicy" if images else "MlpPolicy",
        envs,
        learning_rate=settings.learning_rate,
        buffer_size=settings.buffer,
        learning_starts=settings.warm_up,
        batch_size=settings.batch_size,
        tau=settings.soft_update,
        gamma=settings.discount,
        train_freq=1,
        gradient_steps=settings.updates,
        n_steps=settings.n_steps,
        ent_coef=f"auto_{settings.temperature}",
        policy_kwargs=_network(images, settings.layers, state_scale(names), settings.shift),
        seed=seed,
        device="auto" if images else "cpu",  # small networks are slower on a GPU
    )


def aim(learner: SAC, settings: Settings, progress: float) -> None:
    """Let a learner's temperature aim at the entropy that is due when a training is done to ``progress`` in [0, 1].

    It stays through the first half, to explore, and changes evenly in the second, to be precise.
    """
    first, last = settings.entropy
    assert learner.action_space.shape is not None
    learner.target_entropy = learner.action_space.shape[0] * (first + (last - first) * max(2 * progress - 1, 0.0))


@contextmanager
def unchecked_distributions() -> Iterator[None]:
    """Let torch take the arguments of distributions as they come: its checks are a seventh of an update's time."""
    Distribution.set_default_validate_args(False)
    try:
        yield
    finally:
        Distribution.set_default_validate_args(__debug__)  # as torch begins


def end_episodes(learner: SAC) -> None:
    """Let the episodes end that were under way, as if by a time limit: what follows in the memory is another one."""
    buffer = learner.replay_buffer
    assert buffer is not None
    last = buffer.pos - 1
    buffer.timeouts[last] = np.maximum(buffer.timeouts[last], 1.0 - buffer.dones[last])


def make_actor(observations: gymnasium.Space[Any], actions: gymnasium.spaces.Box, layers: Sequence[int]) -> Actor:
    """The network of an actor as SAC has it, untrained: how it scales the state comes with its weights."""
    images = isinstance(observations, gymnasium.spaces.Dict)
    return SACPolicy(observations, actions, lambda _: 0.0, **_network(images, layers, (), 0)).actor


def _network(images: bool, layers: Sequence[int], scale: Sequence[float], shift: int) -> dict[str, Any]:
    extractor = {"features_extractor_kwargs": {"scale": scale} | ({"shift": shift} if images else {})}
    return extractor | {
        "features_extractor_class": ShiftedExtractor if images else ScaledExtractor,
        "net_arch": list(layers),
        "activation_fn": NormedReLU,
        "optimizer_kwargs": {"fused": True},  # faster, else the same Adam
    }
