"""Episodes of a world, played."""

from collections.abc import Iterable

import numpy as np

from sim_tasks.tasks.arm_task import ArmTask


def play(world: ArmTask, actions: Iterable[np.ndarray]) -> str:
    """Outcome of an episode: ``success``, a failure, or nothing."""
    for action in actions:
        _, _, terminated, _, info = world.step(action)
        if terminated or info["failure"]:
            return info["failure"] or "success"
    return ""
