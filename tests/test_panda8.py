"""The 8-DoF Panda in the pipeline: worlds, demonstrations, encodings, policies."""

import json
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from documented import documented, run, train_in_process
from lerobot.policies.act.configuration_act import ACTConfig

from er_il import ActionSpace, Arm, make_action_space
from er_il.envs.contract import Contract
from er_il.envs.decoders import Decoder
from er_il.envs.wrapper import make_action_space_env
from er_il.policy.actor import environment_of
from er_il.support.errors import UnknownNameError
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.lift_cup import LiftCup

PANDA8 = Arm.preset("panda8")
TASKS = ("LiftCup", "ReachCup", "PushButtonElbow")


def make(task: str) -> tuple[gymnasium.Env, ArmTask]:
    env = gymnasium.make(f"sim_tasks/{task}-v0", arm="panda8")
    assert isinstance(env.unwrapped, ArmTask)
    return env, env.unwrapped


@pytest.mark.parametrize("task", TASKS)
def test_the_leader_leans_and_succeeds_and_so_do_its_encoded_actions(task: str) -> None:
    env, world = make(task)
    env.reset(seed=0)
    demo = np.array(list(world.leader(0)))
    assert demo.shape[1] == 9
    assert np.ptp(demo[:, 0]) > 0.05  # the new joint leans
    for kind in ("joint", "erj"):
        decoding = make_action_space_env(f"sim_tasks/{task}-v0", Decoder(kind), arm="panda8")
        decoding.reset(seed=0)
        assert decoding.action_space.shape == ({"joint": 9, "erj": 10}[kind],)
        info: dict = {}
        for action in ActionSpace(decoding.space).encode(demo[:, :-1], demo[:, -1]):
            _, _, terminated, _, info = decoding.step(action.astype(np.float32))
            assert info["decode_status"] == "ok"
            if terminated:
                break
        assert info["is_success"], f"{kind}: {info['failure']}"


def test_the_furniture_stands_as_high_before_its_shoulder_as_before_the_pandas() -> None:
    heights = {}
    for arm in ("panda", "panda8"):
        world = LiftCup(arm=arm)
        world.reset(seed=0)
        T_base_shoulder = world.data.body("panda_link1").xpos
        heights[arm] = world.object_pose("cup")[2] - T_base_shoulder[2]
        stand = next(shape for shape in world.scene_geometry() if shape.name == "stand_top")
        assert stand.T_parent_shape[2, 3] + stand.size[2] == pytest.approx(world.object_pose("cup")[2])
    assert heights["panda8"] == pytest.approx(heights["panda"], abs=1e-6)
    assert world.shoulder_offset == pytest.approx(0.316)


def test_it_rests_at_home_without_touching_itself_or_sagging() -> None:
    _, world = make("LiftCup")
    world.reset(seed=0)
    touching = [set(world.model.geom_bodyid[contact.geom].tolist()) for contact in world.data.contact]
    assert not any(bodies <= world.robot.bodies for bodies in touching)
    start = world.joint_positions
    for _ in range(20):
        world.step(np.append(start, 1.0))
    np.testing.assert_allclose(world.joint_positions, start, atol=1e-4)


def test_tasks_that_it_cannot_do_refuse_it() -> None:
    with pytest.raises(UnknownNameError, match=r"^Unknown arm for retrieve_bear 'panda8'\. Valid: panda\.$"):
        gymnasium.make("sim_tasks/RetrieveBear-v0", arm="panda8")


@pytest.mark.parametrize("decoder", ["joint", "erj", "task-nearest"])
def test_a_rollout_takes_the_policys_arm(tmp_path: Path, decoder: str) -> None:
    tag = Contract.of_space(make_action_space(decoder.split("-")[0], PANDA8)).tag
    ACTConfig(device="cpu", tags=[tag]).save_pretrained(tmp_path)
    config = environment_of(tmp_path, "lift_cup", decoder)
    assert config.arm == "panda8"
    assert config.features["agent_pos"].shape == (16,)


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_the_pages_commands_make_a_policy_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    train_in_process(monkeypatch, "--batch_size=2", "--policy.dim_model=32", "--policy.dim_feedforward=32")
    run("er-il", *documented("docs/arms.md", "er-il generate lift_cup"), "--episodes=2")
    run("er-il", *documented("docs/arms.md", "er-il train lift_cup"), "--steps=2")
    run("er-il", *documented("docs/arms.md", "er-il eval policies/lift_cup_panda8/erj"), "--episodes=1")
    assert {path.name for path in (tmp_path / "datasets/lift_cup_panda8").iterdir()} == {"joint", "task", "erj"}
    (cell,) = json.loads((tmp_path / "outputs/eval/lift_cup/erj/report.json").read_text())["cells"]
    assert cell["episodes"] == 1
