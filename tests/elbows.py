"""Joint paths of one arm whose hand goes the same way, while the elbow follows the hand or moves by itself."""

from collections.abc import Sequence

import numpy as np

from er_il import Arm
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space

STEPS = 20


def paths_with_elbows(arm: Arm, swings: Sequence[float]) -> list[np.ndarray]:
    """One path (T, n) [rad] an episode: a reach, nearly the same each time, with an elbow that swings by so much [rad].

    The elbow is ERX's coordinate; a swing of 0 leaves it to IK, which moves the joints as little as it can.
    """
    task, erx = make_arm_space("task", arm), make_arm_space("erx", arm)
    assert isinstance(erx, PoseSpace)
    rng, share = np.random.default_rng(0), np.linspace(0.0, 1.0, STEPS)
    found = []
    for swing in swings:
        reach = arm.home + np.outer(share, [0.2, 0.4, 0.0, 0.3, 0.0, 0.2, 0.1]) + rng.normal(scale=0.005, size=arm.dof)
        path = [reach[0]]
        for action in task.encode(reach)[1:]:
            path.append(task.decode(action, path[-1]).q)
        actions = erx.encode(np.array(path))
        actions[:, -1] += swing * np.sin(np.pi * share)
        for t in range(1, STEPS if swing else 0):
            path[t] = erx.decode(actions[t], path[t - 1]).q
        found.append(np.array(path))
    return found
