import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from er_il.envs.decoders import DECODERS, Decoder, decoder
from er_il.envs.tasks import task_id, task_names
from er_il.envs.wrapper import make_action_space_env
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import ErIlError, UnknownNameError

REACH = task_id("reach_cup")


def test_tasks_have_names():
    assert {"reach_cup", "lift_cup"} <= set(task_names())
    with pytest.raises(UnknownNameError, match=r"'reach_cap'. Valid: .*reach_cup"):
        task_id("reach_cap")


def test_reports_know_every_space_and_all_decoders_of_task_space():
    assert {"joint", "erj", "task-nearest", "task-posture", "task-clear"} <= set(DECODERS)
    assert "task" not in DECODERS
    with pytest.raises(UnknownNameError, match=r"task-nearest, task-posture, task-clear"):
        decoder("task")
    with pytest.raises(UnknownNameError, match="nearest, posture, clear"):
        Decoder("task", "random")


@pytest.mark.filterwarnings("ignore:.*(Box action space|unwrapped version):UserWarning")
@pytest.mark.parametrize("name", ["joint", "erj", "task-nearest", "task-posture", "task-clear"])
def test_it_is_a_gymnasium_environment(name: str):
    env = make_action_space_env(REACH, DECODERS[name])
    check_env(env, skip_render_check=True)
    env.close()


@pytest.mark.parametrize("name", ["delta_joint", "delta_task", "delta_erj", "delta_era"])
def test_deltas_have_a_finite_box_and_move_the_arm_by_what_they_say(name: str):
    env = make_action_space_env(REACH, Decoder(name))
    box = env.action_space
    assert isinstance(box, gymnasium.spaces.Box)
    assert np.all(np.isfinite(box.low)) and np.all(np.isfinite(box.high))
    assert box.contains(box.sample()) and box.high[-1] == 1.0 and box.low[-1] == 0.0
    env.reset(seed=3)
    start = env.world.joint_positions
    T_start = kinematics_of(env.world.arm).fk(start)
    change = np.zeros(box.shape)
    change[0] = 0.01
    change[-1] = 1.0
    for _ in range(6):
        *_, info = env.step(change.astype(np.float32))
        assert info["decode_status"] == "ok"
    T_end = kinematics_of(env.world.arm).fk(info["command"])
    if name == "delta_joint":
        np.testing.assert_allclose(info["command"] - start, [0.06, 0, 0, 0, 0, 0, 0], atol=1e-6)
    else:
        np.testing.assert_allclose(T_end[:3, 3] - T_start[:3, 3], [0.06, 0.0, 0.0], atol=1e-4)
    env.close()


def test_an_environment_that_is_no_arm_is_refused_in_one_line():
    with pytest.raises(
        ErIlError,
        match=r"^CartPole-v1 is no arm environment: it lacks arm, task_description, ",
    ):
        make_action_space_env("CartPole-v1", DECODERS["joint"])


def test_encoded_actions_move_the_arm_as_joint_targets_do():
    plain = gymnasium.make(REACH)
    encoded = make_action_space_env(REACH, DECODERS["erj"])
    plain.reset(seed=3)
    encoded.reset(seed=3)
    start = plain.unwrapped.joint_positions
    for step in range(1, 15):
        q = start + 0.01 * step * np.array([-1, 1, 0.5, 0.5, 0, 0, 0.5])
        plain.step(np.append(q, 0.5).astype(np.float32))
        _, _, _, _, info = encoded.step(np.append(encoded.space.encode(q), 0.5).astype(np.float32))
        assert info["decode_status"] == "ok"
        assert info["joint_step"] == pytest.approx(0.01, abs=2e-3)
    np.testing.assert_allclose(
        encoded.unwrapped.joint_positions,
        plain.unwrapped.joint_positions,
        atol=2e-3,
    )


def test_a_reset_forgets_the_last_episode():
    env = make_action_space_env(REACH, DECODERS["joint"], on_invalid="stop")
    first, _ = env.reset(seed=5)
    env.step(np.full(8, np.nan, dtype=np.float32))
    second, _ = env.reset(seed=5)
    np.testing.assert_array_equal(first["agent_pos"], second["agent_pos"])
    q = env.unwrapped.joint_positions
    _, _, terminated, _, info = env.step(np.append(env.space.encode(q), 1.0).astype(np.float32))
    assert not terminated
    assert info["decode_status"] == "ok"


def test_stop_ends_the_episode_as_an_invalid_action():
    env = make_action_space_env(REACH, DECODERS["erj"], on_invalid="stop")
    env.reset(seed=0)
    _, _, terminated, truncated, info = env.step(np.full(9, np.nan, dtype=np.float32))
    assert terminated and not truncated
    assert (info["is_success"], info["failure"], info["decode_status"]) == (False, "invalid_action", "invalid")


@pytest.mark.parametrize("on_invalid", ["best_effort", "hold"])
def test_the_arm_keeps_still_while_actions_mean_nothing(on_invalid: str):
    env = make_action_space_env(REACH, DECODERS["erj"], on_invalid=on_invalid)
    env.reset(seed=0)
    start = env.unwrapped.joint_positions
    for _ in range(10):
        _, _, terminated, _, info = env.step(np.full(9, np.nan, dtype=np.float32))
        assert info["decode_status"] == "invalid" and not terminated
    np.testing.assert_allclose(env.unwrapped.joint_positions, start, atol=5e-3)
