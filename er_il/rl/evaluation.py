"""Episodes of an agent: deterministic, on starts that no training had."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.envs.learning import LearningEnv
from er_il.evaluation.rollout import TIMEOUT, Rollout
from er_il.kinematics.solver import Status

Act = Callable[[Any], NDArray[np.float32]]  # the action (dim,) for an observation


def roll_out(act: Act, env: LearningEnv, seeds: Iterable[int]) -> list[Rollout]:
    """Act from the start of each seed to the episode's end; success is what holds there."""
    return [_roll_out(act, env, seed) for seed in seeds]


def _roll_out(act: Act, env: LearningEnv, seed: int) -> Rollout:
    observation, info = env.reset(seed=seed)
    statuses, done = Counter[str](), False
    while not done:
        observation, _, terminated, truncated, info = env.step(act(observation))
        statuses[info["decode_status"] if info["invalid"] else Status.OK] += 1
        done = terminated or truncated
    success = bool(info["is_success"])
    tally = env.tally
    failure = "" if success else info["failure"] or TIMEOUT
    return Rollout(seed, success, failure, statuses, tuple(tally.latencies), tally.largest_step)
