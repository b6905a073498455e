"""Environments refuse what is no action or no placement, stay as they were, and stay as they ended."""

from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from er_il.envs.decoders import DECODERS
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import ActionSpaceEnv, make_action_space_env
from sim_tasks.tasks.arm_task import ArmTask

GOOD = np.append(np.array([0.1, -0.8, 0.0, -1.95, 0.0, 2.3, 0.8]), 0.7)
NO_NUMBERS = [None, "up", object(), ["a"] * 8, [None] * 8, [[1.0], [1.0, 2.0]], np.full(8, True), {"action": GOOD}]
CHEAP = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def env() -> Iterator[gymnasium.Env]:
    env = gymnasium.make("sim_tasks/LiftCup-v0")
    yield env
    env.close()


@pytest.fixture(scope="module")
def encoded() -> Iterator[ActionSpaceEnv]:
    env = make_action_space_env("lift_cup", DECODERS["erj"])
    yield env
    env.close()


def state(world: ArmTask) -> np.ndarray:
    """All that decides what the world does next."""
    import mujoco  # after sim_tasks, which chooses how it renders

    mj: Any = mujoco
    spec = mj.mjtState.mjSTATE_INTEGRATION
    found = np.empty(mj.mj_stateSize(world.model, spec))
    mj.mj_getState(world.model, world.data, found, spec)
    return found


def refused(world: ArmTask, act: Callable[[], object], message: str = "") -> None:
    """It is a ValueError, and neither it nor the next step shows in the world."""
    before = state(world)
    with pytest.raises(ValueError, match=message):
        act()
    assert np.array_equal(before, state(world))


@pytest.mark.parametrize("bad", NO_NUMBERS, ids=lambda each: str(type(each).__name__))
def test_what_holds_no_numbers_is_no_action(env: gymnasium.Env, encoded: ActionSpaceEnv, bad: Any) -> None:
    for each in (env, encoded):
        world = each.unwrapped
        assert isinstance(world, ArmTask)
        each.reset(seed=0)
        refused(world, lambda: each.step(bad), r"no (real|array of) numbers.*expected \([89],\): .*gripper")  # noqa: B023


@pytest.mark.parametrize("shape", [(), (1,), (7,), (1, 8), (8, 1), (0,), (10,)])
def test_another_shape_is_no_action(env: gymnasium.Env, encoded: ActionSpaceEnv, shape: tuple[int, ...]) -> None:
    for each in (env, encoded):
        world = each.unwrapped
        assert isinstance(world, ArmTask)
        each.reset(seed=0)
        refused(world, lambda: each.step(np.zeros(shape, dtype=np.float32)), r"has shape \(.*\), expected \([89],\): ")  # noqa: B023


def test_a_refused_action_changes_nothing_that_follows(env: gymnasium.Env) -> None:
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    answers = []
    for bad in (False, True):
        env.reset(seed=4)
        env.step(GOOD)
        if bad:
            refused(world, lambda: env.step(np.full(8, np.nan)), "panda_joint1 is nan, expected -2.89")
        observation, reward, *_ = env.step(GOOD)
        answers.append((observation["agent_pos"], reward, state(world)))
    for one, other in zip(*answers, strict=True):
        assert np.array_equal(one, other)


@CHEAP
@given(
    action=arrays(
        np.float64, 8, elements=st.sampled_from([0.0, 0.5, -3.5, 8.0, 57.3, -1e30, 1e300, np.nan, np.inf, -np.inf])
    )
)
def test_numbers_far_beyond_the_limits_never_reach_the_servos(env: gymnasium.Env, action: np.ndarray) -> None:
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    env.reset(seed=0)
    world.reset(seed=0)
    box = env.action_space
    assert isinstance(box, gymnasium.spaces.Box)
    near = np.all((action >= box.low - 2 * np.pi) & (action <= box.high + 2 * np.pi))
    if near:
        env.step(action)
        targets = np.append(world.data.ctrl[world.robot.actuators], world.data.ctrl[world.robot.gripper] / 0.04)
        assert targets == pytest.approx(np.clip(action, box.low, box.high), abs=1e-6)
    else:
        refused(world, lambda: env.step(action), "The action is refused: .* expected .* to ")


@pytest.mark.parametrize("value", [1e30, -1e300, np.finfo(np.float32).max])
@pytest.mark.filterwarnings("error")
def test_an_encoded_action_without_measure_is_limited_like_any_other(encoded: ActionSpaceEnv, value: float) -> None:
    encoded.reset(seed=0)
    start = encoded.world.joint_positions
    *_, info = encoded.step(np.full(9, value))
    assert info["decode_status"] != "ok"
    reach = encoded.space.arm.velocity / encoded.metadata["render_fps"]
    assert np.all(np.abs(info["command"] - start) <= reach + 1e-9)
    assert np.all(np.abs(encoded.world.joint_positions - start) <= reach)


def test_a_step_before_the_first_reset_is_refused() -> None:
    for env, action in (
        (gymnasium.make(task_id("lift_cup")), GOOD),
        (make_action_space_env("lift_cup", DECODERS["joint"]), GOOD),
        (ErIlEnvConfig(task="lift_cup", action_space="joint").create_envs(2)["er_il"][0], np.stack([GOOD, GOOD])),
    ):
        with pytest.raises(ValueError, match="call reset first"):
            env.step(action)
        env.close()


@pytest.mark.parametrize("count", [2, 32])
def test_environments_side_by_side_move_all_or_none(count: int) -> None:
    vector = ErIlEnvConfig(task="lift_cup", action_space="joint").create_envs(count)["er_il"][0]
    vector.reset(seed=0)
    before = [state(world.unwrapped) for world in vector.get_attr("world")]
    for bad in (None, "up", np.tile(GOOD, (count - 1, 1)), np.tile(GOOD, (count + 1, 1)), GOOD, [GOOD, GOOD[:-1]]):
        with pytest.raises(ValueError, match=rf"^The batch of actions .* expected \({count}, 8\)"):
            vector.step(bad)
    assert all(map(np.array_equal, before, (state(world) for world in vector.get_attr("world"))))
    vector.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"states": {}}, r"^Unknown option of reset 'states'. Valid: state, beyond_success."),
        ({"state": {"mug": (0.6, 0.0, 0.0)}}, r"^Unknown object 'mug'. Valid: cup."),
        ({"state": {"cup": (np.nan, 0.0, 0.0)}}, r"x is nan, expected 0.5 to 0.74"),
        ({"state": {"cup": (0.6, 0.2, 0.0)}}, r"y is 0.2, expected -0.15 to 0.15"),
        ({"state": {"cup": (0.6, 0.0, 1e30)}}, r"yaw is 1e\+30, expected -6.28"),
        ({"state": {"cup": (0.6, 0.0)}}, r"has shape \(2,\), expected \(3,\): x, y, yaw"),
        ({"state": {"cup": None}}, r"The pose of cup holds no real numbers but NoneType"),
        ({"state": [0.6, 0.0, 0.0]}, r"expected a pose \(x, y, yaw\) by object"),
        ({"beyond_success": "yes"}, r"beyond_success is 'yes', expected True or False"),
    ],
)
def test_a_placement_that_is_none_leaves_the_episode_as_it_is(
    env: gymnasium.Env, options: dict[str, Any], message: str
) -> None:
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    env.reset(seed=0)
    draws = world.np_random.bit_generator.state
    refused(world, lambda: env.reset(seed=1, options=options), message)
    assert world.np_random.bit_generator.state == draws
    assert not env.step(GOOD)[2]


def test_an_episode_that_has_ended_stays_as_it_ended(monkeypatch: pytest.MonkeyPatch, env: gymnasium.Env) -> None:
    world = env.unwrapped
    assert isinstance(world, ArmTask)
    for verdict, failure in (("_succeeds", ""), ("_fails", "dropped")):
        env.reset(seed=0)
        with monkeypatch.context() as patch:
            patch.setattr(world, verdict, lambda failure=failure: failure or True)
            ended = next(step for step in (env.step(GOOD) for _ in range(10)) if step[2])
        assert float(ended[1]) > 0 and (ended[4]["is_success"], ended[4]["failure"]) == (not failure, failure)
        for _ in range(6):  # the goal no longer holds, nor does the failure
            _, reward, terminated, truncated, info = env.step(GOOD)
            assert (reward, terminated, truncated) == (0.0, True, False)
            assert (info["is_success"], info["failure"]) == (not failure, failure)
            assert set(info["reward_terms"].values()) == {0.0}
    monkeypatch.setattr(world, "max_steps", 1)
    env.reset(seed=0)
    assert [env.step(GOOD)[2:4] for _ in range(3)] == [(False, True)] * 3


def test_an_encoded_episode_that_has_ended_repeats_its_last_answer(encoded: ActionSpaceEnv) -> None:
    stopping = make_action_space_env("lift_cup", DECODERS["erj"], on_invalid="stop")
    stopping.reset(seed=0)
    ended = stopping.step(np.full(9, np.nan, dtype=np.float32))
    q = stopping.world.joint_positions
    again = stopping.step(np.append(stopping.space.encode(q), 1.0).astype(np.float32))
    assert again[1:4] == (0.0, True, False) and again[4]["failure"] == ended[4]["failure"] == "invalid_action"
    assert len(stopping.tally.latencies) == 1
    with pytest.raises(ValueError, match="expected"):
        stopping.step(None)
    stopping.close()
