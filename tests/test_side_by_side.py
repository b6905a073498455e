from collections.abc import Iterator
from unittest.mock import patch

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from lerobot.envs.utils import FreezeAfterEpisodeEnd

from er_il.control.commander import DecodedAhead
from er_il.envs.decoders import DECODERS
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.side_by_side import BATCH_FROM, BatchDecodingEnv, SideBySideEnv
from er_il.envs.wrapper import ActionSpaceEnv, make_action_space_env
from er_il.evaluation.rollouts import POLICY_ROWS

SEEDS: list[int | None] = [0, 1, 2]


def make(name: str) -> gymnasium.Env:
    return FreezeAfterEpisodeEnd(make_action_space_env("lift_cup", DECODERS[name]))


@pytest.fixture(params=["erj", "era", "task-nearest"])
def pair(request: pytest.FixtureRequest) -> Iterator[tuple[SyncVectorEnv, BatchDecodingEnv]]:
    """The same environments, decoding one by one and together."""
    makers = [lambda: make(request.param)] * len(SEEDS)
    envs = SyncVectorEnv(makers), BatchDecodingEnv(makers)
    yield envs
    for env in envs:
        env.close()


def test_environments_answer_as_they_do_alone(pair: tuple[SyncVectorEnv, BatchDecodingEnv]) -> None:
    for env in pair:
        env.reset(seed=SEEDS)
    space, rng = pair[0].get_attr("space")[0], np.random.default_rng(0)
    q = np.array(pair[0].get_attr("world")[0].joint_positions)
    far = space.encode(q + 1.0)
    for step in range(12):
        actions = np.array([space.encode(q + rng.normal(0, 0.02, q.shape)) for _ in SEEDS])
        if step == 6:
            actions[0] = np.nan  # means nothing
            actions[1] = far  # not to be followed in one period
        actions = np.column_stack([actions, np.ones(len(SEEDS))]).astype(np.float32)
        with patch.object(type(space), "decode", autospec=True, side_effect=type(space).decode) as singles:
            together = pair[1].step(actions)
        assert singles.call_count <= 2  # what the batch cannot solve
        one_by_one = pair[0].step(actions)
        assert list(together[4]["decode_status"]) == list(one_by_one[4]["decode_status"])
        np.testing.assert_allclose(together[4]["command"], one_by_one[4]["command"], atol=1e-5)
        np.testing.assert_allclose(together[0]["agent_pos"], one_by_one[0]["agent_pos"], atol=1e-4)
    for one, other in zip(*(env.get_attr("tally") for env in pair), strict=True):
        assert one.statuses == other.statuses and all(seconds > 0 for seconds in other.latencies)


def test_what_was_decoded_before_a_reset_is_forgotten() -> None:
    env = make_action_space_env("lift_cup", DECODERS["erj"])
    env.reset(seed=0)
    q = env.world.joint_positions
    env.ahead = [DecodedAhead(env.space.decode(env.space.encode(q + 0.01), seed=q), 0.0)]
    env.reset(seed=0)
    *_, info = env.step(np.append(env.space.encode(q), 1.0).astype(np.float32))
    np.testing.assert_allclose(info["command"], q, atol=1e-5)
    env.close()


def test_so_many_that_a_batch_is_faster_decode_together() -> None:
    assert BATCH_FROM > POLICY_ROWS  # outcomes of er-il eval do not depend on how many run side by side
    for count, kind in ((BATCH_FROM - 1, SideBySideEnv), (BATCH_FROM, BatchDecodingEnv)):
        env = ErIlEnvConfig(task="lift_cup", action_space="erj").create_envs(count)["er_il"][0]
        assert type(env) is kind
        assert all(
            isinstance(each, FreezeAfterEpisodeEnd) and isinstance(each.env, ActionSpaceEnv) for each in env.envs
        )
        env.close()
