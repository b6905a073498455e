"""Environments side by side in one process, whose actions are decoded in one batch."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from er_il.control.commander import DecodedAhead
from er_il.envs.wrapper import ActionSpaceEnv

# From so many environments on a batch is the faster one (docs/speed.md). It is more than `er-il eval` runs side by
# side, whose outcomes therefore depend on their seeds alone: a batch rounds otherwise than a single decode.
BATCH_FROM = 32


class BatchDecodingEnv(SyncVectorEnv):
    """Steps environments of one action space one after the other, and decodes their actions together before.

    The environments answer as they do alone, but for the last digits of the decoded joints.
    """

    def __init__(self, makers: Sequence[Callable[[], gymnasium.Env[Any, Any]]]) -> None:
        """Make the environments: :class:`ActionSpaceEnv`, or wrappers around it that pass actions on as they are."""
        super().__init__(makers, autoreset_mode=AutoresetMode.NEXT_STEP)
        self._inner = [_action_space_env(env) for env in self.envs]

    def step(self, actions: Any) -> Any:
        started = time.perf_counter()
        queries = [env.query(action) for env, action in zip(self._inner, actions, strict=True)]
        batch = self._inner[0].space.decode_batch(*map(np.array, zip(*queries, strict=True)))
        seconds = (time.perf_counter() - started) / self.num_envs
        for row, env in enumerate(self._inner):
            env.ahead = DecodedAhead(batch.result(row), seconds)
        return super().step(actions)


def _action_space_env(env: gymnasium.Env[Any, Any]) -> ActionSpaceEnv:
    while not isinstance(env, ActionSpaceEnv):
        assert isinstance(env, gymnasium.Wrapper), "None of the wrappers takes encoded actions."
        env = env.env
    return env
