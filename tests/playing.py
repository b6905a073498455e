"""Playing episodes."""

from collections.abc import Iterable

import numpy as np

from sim_tasks.tasks.arm_task import ArmTask


def play(world: ArmTask, actions: Iterable[np.ndarray]) -> str:
    """Outcome of an episode: ``success``, the failure, or an empty string if the actions end first."""
    for action in actions:
        _, _, terminated, truncated, info = world.step(action)
        if terminated or truncated:
            return info["failure"] or "success"
    return ""
