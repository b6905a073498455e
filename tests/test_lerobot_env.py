import importlib.metadata

import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from lerobot.envs import EnvConfig, env_to_policy_features, make_env
from lerobot.envs.factory import make_env_config
from lerobot.envs.utils import NEW_ROLLOUT_OPTION
from lerobot.utils.import_utils import register_third_party_plugins

from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.support.errors import UnknownNameError


def test_lerobot_finds_the_environment_by_the_distributions_name():
    assert importlib.metadata.distribution("lerobot_env_er_il").metadata["Name"].startswith("lerobot_env_")
    register_third_party_plugins()
    assert EnvConfig.get_choice_class("er_il") is ErIlEnvConfig


def test_the_features_are_the_environments():
    config = make_env_config("er_il", task="reach_cup", action_space="erj", cameras=["wrist"], image_size=64)
    shapes = {key: feature.shape for key, feature in env_to_policy_features(config).items()}
    assert shapes == {
        "action": (9,),
        "observation.state": (15,),
        "observation.environment_state": (7,),
        "observation.images.wrist": (3, 64, 64),
    }
    assert config.fps == 20


@pytest.mark.parametrize(("space", "rotation", "dim"), [("joint", "quat", 8), ("task", "rot6d", 10)])
def test_the_action_is_the_spaces(space: str, rotation: str, dim: int):
    assert ErIlEnvConfig(action_space=space, rotation=rotation).features["action"].shape == (dim,)


@pytest.mark.parametrize(
    ("options", "choices"),
    [
        ({"task": "reach_cap"}, "lift_cup.*reach_cup"),
        ({"action_space": "jiont"}, "joint, task, erj"),
        ({"action_space": "task", "resolution": "best"}, "nearest, posture, clear"),
        ({"rotation": "euler"}, "quat, rot6d"),
        ({"on_invalid": "panic"}, "best_effort, hold, stop"),
    ],
)
def test_wrong_options_name_the_right_ones(options: dict[str, str], choices: str):
    with pytest.raises(UnknownNameError, match=choices):
        ErIlEnvConfig(**options)


def test_films_have_the_size_that_was_asked_for():
    sizes = [{}, {"visualization_width": 64, "visualization_height": 48}]
    shapes = []
    for size in sizes:
        env = ErIlEnvConfig(**size).make()
        env.reset(seed=0)
        shapes.append(np.asarray(env.render()).shape)
        env.close()
    assert shapes == [(240, 320, 3), (48, 64, 3)]


def test_an_episode_that_has_ended_waits_without_leaking_its_successor():
    config = ErIlEnvConfig(action_space="joint", on_invalid="stop")
    vector = make_env(config, n_envs=2)["er_il"][0]
    observation, _ = vector.reset(seed=[1, 2], options={NEW_ROLLOUT_OPTION: True})
    broken = observation["agent_pos"][:, :8].copy()
    broken[0] = np.nan  # the first environment stops at once, the second stands still
    ended, reward, terminated, _, info = vector.step(broken)
    assert terminated.tolist() == [True, False]
    for _ in range(3):
        observation, reward, _, _, info = vector.step(observation["agent_pos"][:, :8])
        np.testing.assert_array_equal(observation["agent_pos"][0], ended["agent_pos"][0])
        assert reward[0] == 0
        assert info["failure"][0] == "invalid_action"
        assert not info["is_success"][0]
    assert [len(tally.latencies) for tally in vector.get_attr("tally")] == [1, 4]
    vector.close()


@pytest.mark.slow
def test_worker_processes_give_the_same_episodes():
    config = ErIlEnvConfig(action_space="erj")
    rng = np.random.default_rng(0)
    start = config.make().reset(seed=0)[0]["agent_pos"]
    action = np.concatenate([start[8:15], start[:1], [1.0]]) + 0.01 * rng.normal(size=(5, 2, 9))
    episodes = []
    for use_async in (False, True):
        vector = make_env(config, n_envs=2, use_async_envs=use_async)["er_il"][0]
        assert isinstance(vector, AsyncVectorEnv) is use_async
        seen = [vector.reset(seed=[0, 1], options={NEW_ROLLOUT_OPTION: True})[0]["agent_pos"].copy()]
        for step in action:
            observation, *_, info = vector.step(step.astype(np.float32))
            assert set(info["decode_status"]) == {"ok"}
            seen.append(observation["agent_pos"].copy())
        episodes.append(np.array(seen))
        vector.close()
    np.testing.assert_array_equal(*episodes)
