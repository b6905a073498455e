"""Environments for reinforcement learning: modes, decisions, invalid actions, ends."""

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check
from stable_baselines3.common.env_checker import check_env as stable_baselines_check

from er_il.envs import LearningEnv, make_rl_env
from er_il.envs.learning import BOUNDS, DECISIONS, INVALIDS, LEAD, MODES, RATE, SUCCESSES
from er_il.support.errors import ArmError, NotResetError, NumbersError, ShapeError, UnknownNameError
from sim_tasks import RL_TASKS

DIMENSIONS = {"joint": 8, "task": 7, "erj": 8, "era": 8, "erx": 8, "erj-free": 8, "erx-free": 8}


def check(env: LearningEnv) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*render_modes|.*wrapped by|.*infinity|.*Box observation space.*")
        gymnasium_check(env, skip_render_check=True)
        stable_baselines_check(env, warn=True, skip_render_check=True)


def names(env: LearningEnv, prefix: str) -> list[int]:
    return [i for i, name in enumerate(env.observation_names) if name.startswith(prefix)]


TASKS = [entry.task for entry in RL_TASKS]
CHECKED = [(task, mode) for task in TASKS for mode in MODES if task == TASKS[0] or not mode.startswith("erx")]


@pytest.mark.parametrize(("task", "mode"), CHECKED)
def test_every_task_in_every_mode_passes_the_checkers_of_gymnasium_and_stable_baselines(task: str, mode: str) -> None:
    env = make_rl_env(task, mode)
    check(env)
    assert env.action_space.shape == (DIMENSIONS[mode],) == (len(env.action_names),)
    assert env.observation_space.shape == (len(env.observation_names),)
    env.close()


def test_images_come_as_a_dict_with_the_robots_own_state() -> None:
    env = make_rl_env("reach_target", "erj", pixels=True)
    check(env)
    observation, _ = env.reset(seed=0)
    assert {name: array.shape for name, array in observation.items()} == {
        "wrist": (84, 84, 3),
        "front": (84, 84, 3),
        "state": (len(env.observation_names),),
    }
    assert not any(name.startswith("ball") for name in env.observation_names)
    assert observation["front"].std() > 10
    env.close()


def test_gymnasium_ids_make_the_same_environments() -> None:
    env, own = (
        gymnasium.make("er_il.envs.learning:er_il/ReachTarget-erj-free-v0"),
        make_rl_env("reach_target", "erj-free"),
    )
    assert isinstance(env.unwrapped, LearningEnv)
    for each in (env, own):
        each.action_space.seed(0)
    assert np.array_equal(env.reset(seed=3)[0], own.reset(seed=3)[0])
    for _ in range(5):
        one, other = env.step(env.action_space.sample()), own.step(own.action_space.sample())
        assert np.array_equal(one[0], other[0]) and one[1:4] == other[1:4]


@pytest.mark.parametrize("mode", MODES)
def test_a_decision_takes_a_tenth_of_a_second_in_every_mode(mode: str) -> None:
    env = make_rl_env("reach_target", mode)
    env.reset(seed=0)
    data = env.world.data
    start = data.time
    steps = 7
    for _ in range(steps):
        env.step(np.zeros(env.action_space.shape, np.float32))
    assert data.time - start == pytest.approx(steps / RATE)
    assert env.metadata["render_fps"] == RATE


def test_ones_are_the_papers_step_sizes() -> None:
    changes = {"joint": BOUNDS.angle, "task": BOUNDS.position, "erj-free": BOUNDS.position, "erj": BOUNDS.position}
    for mode, change in changes.items():
        env = make_rl_env("reach_target", mode, start_range=0.0)
        env.reset(seed=0)
        before, hand = env.world.joint_positions, env.world.ee_pose[:3, 3].copy()
        action = np.zeros(env.action_space.shape, np.float32)
        action[2] = 7.0  # beyond the Box: clipped
        _, _, _, _, info = env.step(action)
        moved = info["command"] - before
        if mode == "joint":
            assert moved == pytest.approx(change * np.eye(7)[2], abs=1e-6)
        else:
            assert env.world.ee_pose[:3, 3] - hand == pytest.approx([0, 0, change], abs=0.01)


def test_the_state_tells_the_lag_the_velocities_and_where_things_are_from_the_hand() -> None:
    env = make_rl_env("reach_target", "joint")
    state, _ = env.reset(seed=1)
    assert state[names(env, "ee.")][:3] + state[names(env, "ball.d")] == pytest.approx(
        env.world.object_pose("ball")[:3],
        abs=1e-5,
    )
    assert np.all(state[names(env, "panda_joint1.left")] == 0) and state[names(env, "grasped")] == 0
    action = np.zeros(8, np.float32)
    action[0] = 1.0
    state, _, _, _, info = env.step(action)
    left = [env.observation_names.index(f"{joint}.left") for joint in env.world.arm.joints]
    assert state[left] == pytest.approx(info["command"] - env.world.joint_positions, abs=1e-6)
    assert state[names(env, "panda_joint1.vel")] == pytest.approx(env.world.joint_velocities[0], abs=1e-6)
    x, y = state[names(env, "ee.x")][1:4], state[names(env, "ee.y")][1:4]
    assert x @ y == pytest.approx(0, abs=1e-5) and x @ x == pytest.approx(1, abs=1e-5)


def test_invalid_actions_hold_earn_nothing_are_counted_and_five_in_a_row_truncate() -> None:
    env = make_rl_env("reach_target", "task")
    env.reset(seed=0)
    outward = np.array([1, 0, 1, 0, 0, 0, 1], np.float32)
    invalids = 0
    for _ in range(60):
        before = env._env.last_command.copy()
        _, reward, terminated, truncated, info = env.step(outward)
        assert not terminated
        if info["invalid"]:
            invalids += 1
            assert reward == 0.0 and np.array_equal(info["command"], before)
        if truncated:
            break
    assert truncated and info["failure"] == "" and info["invalid_actions"] == invalids >= INVALIDS


def test_a_joint_stops_at_its_limit_and_that_is_valid() -> None:
    env = make_rl_env("reach_target", "joint")
    env.reset(seed=0)
    action = np.zeros(8, np.float32)
    action[3] = 1.0
    for _ in range(40):
        _, reward, _, truncated, info = env.step(action)
        assert not info["invalid"] and reward > 0 and not truncated
    assert info["command"][3] == pytest.approx(env.world.arm.upper[3])
    assert env.step(np.full(8, np.nan, np.float32))[4]["invalid"]


def test_ten_successes_in_a_row_truncate_and_success_is_no_end() -> None:
    env = make_rl_env("reach_target", "task")
    env.reset(seed=0)
    ends, rewards = [], []
    for _ in range(100):
        way = env.world.object_pose("ball")[:3] - env.world.ee_pose[:3, 3]
        action = np.append(np.append(np.clip(way / BOUNDS.position, -1, 1), np.zeros(3)), 1.0).astype(np.float32)
        _, reward, terminated, truncated, info = env.step(action)
        assert not terminated
        ends.append(info["is_success"])
        rewards.append(reward)
        if truncated:
            break
    assert truncated and ends[-SUCCESSES:] == [True] * SUCCESSES and sum(ends) == SUCCESSES
    assert rewards[-SUCCESSES:] == [1.0] * SUCCESSES


def test_the_gripper_closes_below_zero_and_the_task_sees_how_far() -> None:
    env = make_rl_env("phone_on_base", "task")
    env.reset(seed=0)
    world: Any = env.world
    for asked, opening, fingers in ((-1.0, 0.0, 0.0), (-0.2, 0.4, 0.0), (0.2, 0.6, 0.04)):
        env.step(np.append(np.zeros(6), asked).astype(np.float32))
        assert world.commanded_opening == pytest.approx(opening)
        assert world.data.ctrl[world.robot.gripper] == pytest.approx(fingers)  # [m]


def drop_beside_the_bench(env: Any, thing: str) -> tuple[Any, ...]:
    """The last of twenty idle steps after a thing was put beside the bench, or of fewer if the episode ends."""
    env.world.data.joint(thing).qpos[:3] = 0.4, 0.9, 0.1
    for _ in range(20):
        step = env.step(np.zeros(8, np.float32))
        if step[3]:
            break
    return step


@pytest.mark.parametrize("task", ["put_rubbish_in_bin", "serve_coffee_obstacles", "pick_and_lift", "meat_off_grill"])
def test_what_a_task_is_about_cuts_an_episode_short_as_it_falls_off_the_bench(task: str) -> None:
    env = make_rl_env(task, "joint")
    env.reset(seed=0)
    world: Any = env.world
    (thing,) = world.needed
    state, _, terminated, truncated, info = drop_beside_the_bench(env, thing)
    assert truncated and not terminated and info["failure"] == "fell"  # no end of value 0: it would teach to keep away
    assert np.abs(state).max() < 10  # before it is far away


@pytest.mark.parametrize("task", ["put_rubbish_in_bin", "pick_and_lift", "meat_off_grill"])
def test_other_things_may_fall(task: str) -> None:
    env = make_rl_env(task, "joint")
    env.reset(seed=0)
    world: Any = env.world
    thing = next(name for name in world.graspable if name not in world.needed)
    state, _, terminated, truncated, info = drop_beside_the_bench(env, thing)
    assert not (terminated or truncated) and info["failure"] == ""
    assert world.position(thing)[2] < -1.0 and np.abs(state).max() < 10  # it is not observed


def test_an_idle_episode_is_truncated_after_the_papers_200_decisions() -> None:
    env = make_rl_env("reach_target", "joint")
    env.reset(seed=2)
    for step in range(1, 201):
        _, _, terminated, truncated, info = env.step(np.zeros(8, np.float32))
        assert not terminated and truncated == (step == 200)
    assert info["failure"] == "timeout"


def test_erj_takes_the_joint_that_it_commands() -> None:
    env = make_rl_env("reach_target", "erj@panda_joint3")
    assert env.action_names[6] == "panda_joint3.delta"


def test_what_is_wrong_is_told() -> None:
    with pytest.raises(
        UnknownNameError, match=r"Unknown mode 'ik'\. Valid: joint, task, erj, era, erx, erj-free, erx-free\."
    ):
        make_rl_env("reach_target", "ik")
    with pytest.raises(UnknownNameError, match="Unknown task 'fly'"):
        make_rl_env("fly")
    with pytest.raises(ArmError, match="redundant"):
        make_rl_env("push_button_elbow", "era", arm="panda8")
    env = make_rl_env("reach_target", "erj")
    with pytest.raises(NotResetError):
        env.step(np.zeros(8, np.float32))
    env.reset(seed=0)
    with pytest.raises(ShapeError, match=r"The action has shape \(7,\), expected \(8,\)"):
        env.step(np.zeros(7, np.float32))
    with pytest.raises(NumbersError):
        env.step("left")


def test_imitation_tasks_are_learnable_too() -> None:
    env = make_rl_env("lift_cup", "erj")
    state, _ = env.reset(seed=0)
    assert np.all(np.isfinite(state)) and len(names(env, "cup.")) == 9
    env.step(np.zeros(8, np.float32))


@pytest.mark.parametrize(("mode", "longest"), [("joint", 0.05), ("era", 0.5), ("task", 2.5), ("erj", 2.5)])
def test_the_papers_pace_waits_until_the_arm_has_settled(mode: str, longest: float) -> None:
    env = make_rl_env("reach_target", mode, pace="settled", anchor="measured")
    env.reset(seed=0)
    data, action = env.world.data, np.zeros(env.action_space.shape, np.float32)
    action[:3] = 1.0
    start = data.time
    _, _, _, _, info = env.step(action)
    taken = data.time - start
    assert 0.047 <= taken <= longest + 1e-6  # whole steps of physics
    if mode == "joint":
        assert taken == pytest.approx(0.05, abs=0.003)  # whole steps of physics
    else:
        assert taken > 0.1 and np.abs(info["command"] - env.world.joint_positions).max() < 0.02


def test_deltas_count_from_the_measured_joints_if_asked() -> None:
    action = np.zeros(8, np.float32)
    action[0] = 1.0
    commands = {}
    for anchor in ("command", "measured"):
        env = make_rl_env("reach_target", "joint", anchor=anchor, start_range=0.0)
        env.reset(seed=0)
        env.step(action)
        measured = env.world.joint_positions[0]
        commands[anchor] = env.step(action)[4]["command"][0]
        expected = 2 * BOUNDS.angle if anchor == "command" else measured + BOUNDS.angle
        assert commands[anchor] == pytest.approx(expected, abs=1e-6)
    assert abs(commands["measured"] - commands["command"]) > 1e-3


def test_a_command_does_not_wind_up_against_the_bench() -> None:
    env = make_rl_env("reach_target", "task", start_range=0.0)
    env.reset(seed=0)
    down, up = np.zeros(7, np.float32), np.zeros(7, np.float32)
    down[2], up[2] = -1.0, 1.0
    free = [env.step(down)[4]["command"] for _ in range(3)]
    expected = env.space.decode(np.array([0, 0, -BOUNDS.position, 0, 0, 0]), free[1], free[1]).q
    np.testing.assert_array_equal(free[2], expected)  # in free motion it counts from the last command
    for _ in range(40):
        lead = np.abs(env._env.last_command - env.world.joint_positions).max()
        command = env.step(down)[4]["command"]
        assert np.abs(command - env.world.joint_positions).max() < LEAD + 0.3  # it, and one more change
    assert lead > LEAD / 2 and env.world.tip[2] < 0.03  # it presses
    height = env.world.tip[2]
    env.step(up), env.step(up), env.step(up)
    assert env.world.tip[2] > height + 0.03  # and rises at once


def test_an_episode_has_at_most_as_many_decisions_at_the_papers_pace() -> None:
    env = make_rl_env("reach_target", "task", pace="settled")
    env.reset(seed=0)
    for decision in range(1, DECISIONS + 1):
        _, _, terminated, truncated, _ = env.step(np.zeros(7, np.float32))
        assert not terminated and truncated == (decision == DECISIONS)
    with pytest.raises(UnknownNameError, match="Unknown pace 'slow'"):
        make_rl_env("reach_target", "task", pace="slow")
