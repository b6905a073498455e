"""Bimanual Press: two arms through environments, decoders, recordings and contracts, and why both elbows matter."""

import json
from pathlib import Path

import numpy as np
import pytest
from documented import documented, run, train_in_process
from gymnasium.utils.env_checker import check_env
from playing import play

from er_il.arms.robot import robot_arms
from er_il.control.commander import STOP
from er_il.envs.contract import Contract
from er_il.envs.decoders import DECODERS
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.side_by_side import BatchDecodingEnv
from er_il.envs.wrapper import INVALID_ACTION, ActionSpaceEnv, make_action_space_env
from er_il.evaluation.recording import record_rollout
from er_il.policy.training import pretrained
from er_il.spaces.layout import Layout
from er_il.support.errors import UnknownNameError
from er_il.viewer.show import save_rollout
from sim_tasks.tasks.bimanual_press import PRESSED, BimanualPress
from sim_tasks.world.press import SIDES

TASK = "bimanual_press"
ARMS = robot_arms("openarm_v2")
GRIPPERS = [7, 15]


@pytest.fixture(scope="module")
def world() -> BimanualPress:
    return BimanualPress()


@pytest.fixture(scope="module")
def demonstration(world: BimanualPress) -> np.ndarray:
    """The leader's joint targets (T, 16) on seed 0."""
    world.reset(seed=0)
    return np.array(list(world.leader(0)))


def encoded(env: ActionSpaceEnv, script: np.ndarray) -> np.ndarray:
    return env.layout.encode(script).astype(np.float32)


def test_passes_gymnasiums_checker_and_both_hands_carry_cameras() -> None:
    world = BimanualPress(cameras=("left_wrist", "right_wrist", "head"), image_size=48, render_mode="rgb_array")
    check_env(world)
    pixels = world.reset(seed=0)[0]["pixels"]
    assert all(image.shape == (48, 48, 3) and image.std() > 10 for image in pixels.values())
    world.close()


def test_the_leader_presses_both_buttons_within_the_arms_speeds(world: BimanualPress) -> None:
    speeds = np.concatenate([arm.velocity for arm in ARMS.values()])
    for seed in range(3):
        _, info = world.reset(seed=seed, options={"beyond_success": True})
        start, rewards = world.joint_positions, [float(sum(info["reward_terms"].values()))]
        script = np.array(list(world.leader(seed)))
        joints = np.delete(script, GRIPPERS, axis=1)
        assert np.all(np.abs(np.diff(np.vstack([start, joints]), axis=0)) * world.rate <= speeds)
        for action, targets in zip(script, joints, strict=True):
            _, reward, _, _, info = world.step(action.astype(np.float32))
            rewards.append(reward)
            assert np.abs(world.joint_positions - targets).max() < 0.03
        assert info["is_success"] and rewards[-1] == 1.0 and rewards[0] < 0.2
        assert np.all(rewards > np.maximum.accumulate(rewards) - 0.01)
        assert all(world.travel(side) > PRESSED + 0.004 for side in SIDES)


def test_one_button_is_not_enough(world: BimanualPress, demonstration: np.ndarray) -> None:
    world.reset(seed=0)
    lazy = demonstration.copy()
    lazy[:, 8:15] = world.joint_positions[7:]  # the right arm stays
    assert play(world, [*lazy, *lazy[-1:].repeat(world.max_steps, axis=0)]) == "one_button"
    world.reset(seed=0)
    assert play(world, demonstration[:1].repeat(world.max_steps, axis=0)) == "not_pressed"


@pytest.mark.parametrize("decoder", [name for name in DECODERS if "clear" not in name])  # which is for one arm
def test_only_what_says_where_the_elbows_are_gets_through(decoder: str, demonstration: np.ndarray) -> None:
    env = make_action_space_env(TASK, DECODERS[decoder], arm="openarm_v2")
    env.reset(seed=0)
    outcome = "collision" if decoder.removeprefix("rel_").startswith("task") else "success"
    assert play(env, encoded(env, demonstration)) == outcome


def test_each_elbow_matters_by_itself(world: BimanualPress, demonstration: np.ndarray) -> None:
    """One arm as demonstrated, the other by its hand's pose alone."""
    spaces = {name: DECODERS[name].layout_of(ARMS) for name in ("erj", "task-nearest")}
    for free in range(2):
        parts = [spaces["task-nearest" if i == free else "erj"].parts[i] for i in range(2)]
        layout = Layout(spaces["erj"].names, tuple(parts))
        world.reset(seed=0)
        vector, outcome = demonstration[0], "unfinished"
        for action in layout.encode(demonstration):
            vector = layout.decode(action, vector).vector
            _, _, terminated, _, info = world.step(vector)
            if terminated:
                outcome = "success" if info["is_success"] else info["failure"]
                break
        assert outcome == "collision"


def test_two_arms_make_one_action_and_one_answer(demonstration: np.ndarray) -> None:
    env = make_action_space_env(TASK, DECODERS["erj"], arm="openarm_v2", on_invalid=STOP)
    observation, _ = env.reset(seed=0)
    names = env.layout.encoded_names
    assert names[7] == "left_openarm_left_joint3.pos" and names[-2:] == ("left_gripper", "right_gripper")
    assert env.action_space.shape == (len(names),) == (18,)
    np.testing.assert_allclose(observation["agent_pos"][:14], env.world.joint_positions, atol=1e-6)
    actions = encoded(env, demonstration)
    *_, info = env.step(actions[0])
    np.testing.assert_allclose(info["command"], np.delete(demonstration[0], GRIPPERS), atol=1e-5)
    assert env.tally.statuses == {"ok": 2} and len(env.tally.latencies) == 1
    broken = actions[1].copy()
    broken[8] = np.nan  # the right hand's x
    *_, terminated, _, info = env.step(broken)
    assert terminated and info["failure"] == INVALID_ACTION and info["decode_status"] == "invalid"


def test_a_batch_decodes_as_each_does_alone(demonstration: np.ndarray) -> None:
    def make() -> ActionSpaceEnv:
        return make_action_space_env(TASK, DECODERS["era"], arm="openarm_v2")

    alone, batch = make(), BatchDecodingEnv([make, make])
    alone.reset(seed=0)
    batch.reset(seed=[0, 1])
    for action in encoded(alone, demonstration)[:10]:
        alone.step(action)
        batch.step(np.stack([action, action]))
    first = batch.envs[0]
    assert isinstance(first, ActionSpaceEnv)
    np.testing.assert_allclose(first.world.joint_positions, alone.world.joint_positions, atol=1e-6)


def test_lerobots_environment_and_the_contract_know_both_arms() -> None:
    config = ErIlEnvConfig(task=TASK, action_space="erj", arm="openarm_v2")
    assert config.features["action"].shape == (18,) and config.features["agent_pos"].shape == (30,)
    contract = Contract.of_space(config.layout)
    assert contract.tag == (
        "er_il:erj/openarm_v2/openarm_left_hand_tcp+openarm_right_hand_tcp/quat/openarm_left_joint3+openarm_right_joint3"
    )
    assert Contract.of_tags([contract.tag]) == contract
    with pytest.raises(UnknownNameError, match=r"Unknown robot for bimanual_press 'panda'. Valid: openarm_v2."):
        ErIlEnvConfig(task=TASK)


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker", "small_films")
def test_the_pages_commands_make_a_policy_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    train_in_process(monkeypatch, "--batch_size=2", "--policy.dim_model=32", "--policy.dim_feedforward=32")
    run("er-il", *documented("docs/arms.md", "er-il generate bimanual_press"), "--episodes=2")
    run("er-il", *documented("docs/arms.md", "er-il train bimanual_press"), "--steps=2")
    run("er-il", *documented("docs/arms.md", "er-il eval policies/bimanual_press/erj"), "--episodes=1")
    (cell,) = json.loads((tmp_path / f"outputs/eval/{TASK}/erj/report.json").read_text())["cells"]
    assert cell["episodes"] == 1
    run("er-il", "replay", f"datasets/{TASK}/erj")
    (replayed,) = json.loads((tmp_path / "outputs/replay/report.json").read_text())["cells"]
    assert replayed["successes"] == 2
    trace, pictures = record_rollout(pretrained(Path(f"policies/{TASK}/erj")), TASK, "erj", 1000, film_every=40)
    assert trace.q.shape[1] == 7 and trace.action.shape[1] == 9 and len(pictures) > 1
    save_rollout(trace, tmp_path / "left.rrd")
