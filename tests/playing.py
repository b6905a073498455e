"""Playing episodes."""

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np


def play(world: gymnasium.Env, actions: Iterable[np.ndarray]) -> str:
    """Outcome of an episode: ``success``, the failure, or an empty string if the actions end first."""
    for action in actions:
        _, _, terminated, truncated, info = world.step(action)
        if terminated or truncated:
            return info["failure"] or "success"
    return ""


def play_on(world: gymnasium.Env, actions: Iterable[np.ndarray]) -> dict[str, Any]:
    """What the last action told: actions go on beyond success."""
    info: dict[str, Any] = {}
    for action in actions:
        info = world.step(action)[4]
    return info
