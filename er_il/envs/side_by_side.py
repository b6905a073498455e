"""Environments side by side, whose actions are checked before any of them moves, and decoded in one batch if many."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv
from numpy.typing import NDArray

from er_il.control.commander import DecodedAhead
from er_il.envs.wrapper import ActionSpaceEnv
from er_il.support.vectors import number_array

# From so many environments on a batch is the faster one (docs/speed.md). It is more than `er-il eval` runs side by
# side, whose outcomes therefore depend on their seeds alone: a batch rounds otherwise than a single decode.
BATCH_FROM = 32


class SideBySideEnv(SyncVectorEnv):
    """Environments in one process, one after the other; a batch that is none is refused before any of them moves."""

    def step(self, actions: Any) -> Any:
        """Step all environments; raises a ValueError unless ``actions`` is an array (num_envs, dim) of numbers."""
        return super().step(_batch(self, actions))


class ProcessesEnv(AsyncVectorEnv):
    """Environments in a process each; a batch that is none is refused before any of them moves."""

    def step(self, actions: Any) -> Any:
        """Step all environments; raises a ValueError unless ``actions`` is an array (num_envs, dim) of numbers."""
        return super().step(_batch(self, actions))


class BatchDecodingEnv(SideBySideEnv):
    """Steps environments of one action space one after the other, and decodes their actions together before.

    The environments answer as they do alone, but for the last digits of the decoded joints.
    """

    def __init__(self, makers: Sequence[Callable[[], gymnasium.Env[Any, Any]]]) -> None:
        """Make the environments: :class:`ActionSpaceEnv`, or wrappers around it that pass actions on as they are."""
        super().__init__(makers, autoreset_mode=AutoresetMode.NEXT_STEP)
        self._inner = [_action_space_env(env) for env in self.envs]

    def step(self, actions: Any) -> Any:
        started = time.perf_counter()
        actions = _batch(self, actions)
        queries = [env.query(action) for env, action in zip(self._inner, actions, strict=True)]
        of_arms = zip(self._inner[0].layout.parts, zip(*queries, strict=True), strict=True)
        batches = [part.space.decode_batch(*map(np.array, zip(*own, strict=True))) for part, own in of_arms]
        seconds = (time.perf_counter() - started) / self.num_envs / len(batches)
        for row, env in enumerate(self._inner):
            env.ahead = [DecodedAhead(batch.result(row), seconds) for batch in batches]
        return super().step(actions)


def _batch(env: VectorEnv[Any, Any, Any], actions: object) -> NDArray[np.float64]:
    shape = (env.num_envs, *(env.single_action_space.shape or ()))
    return number_array("The batch of actions", actions, shape, "one action an environment")


def _action_space_env(env: gymnasium.Env[Any, Any]) -> ActionSpaceEnv:
    while not isinstance(env, ActionSpaceEnv):
        assert isinstance(env, gymnasium.Wrapper), "None of the wrappers takes encoded actions."
        env = env.env
    return env
