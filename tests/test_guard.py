"""No unattached policy moves an arm: what the plugin refuses when LeRobot imports it."""

import importlib
import json
import logging
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.utils import import_utils
from safetensors.numpy import save_file

from er_il import Arm
from er_il.datasets.schema import action_feature
from er_il.envs.contract import DECODE_POLICY_ACTION, Contract
from er_il.robots.command_line import RobotCommand
from er_il.robots.guard import check, check_command
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import DatasetError, PolicyError

PANDA = Arm.preset("panda")
REFUSED = "trained in {} action space; so101_follower would take its numbers for joints"


def policy(folder: Path, *, space: str = "", tag: str = "", means: dict[str, list[float]] | None = None) -> str:
    """A policy's folder as LeRobot's training leaves it, but for the weights: of a dataset, with a tag, statistics."""
    folder.mkdir()
    root = folder.parent / "data"
    if space:
        (root / "meta").mkdir(parents=True)
        layout = Layout.of_space(make_arm_space(space, PANDA))
        (root / "meta/info.json").write_text(json.dumps({"features": {"action": action_feature(layout)}, "fps": 20}))
    ACTConfig(device="cpu", tags=[tag] if tag else None).save_pretrained(folder)
    (folder / "train_config.json").write_text(json.dumps({"dataset": {"repo_id": "me/data", "root": str(root)}}))
    steps = [{"registry_name": "unnormalizer_processor", "config": {}, "state_file": "statistics.safetensors"}]
    (folder / "policy_postprocessor.json").write_text(json.dumps({"steps": steps}))
    tensors = {f"{name}.mean": np.array(values, dtype=np.float32) for name, values in (means or {}).items()}
    save_file(tensors | {"index.mean": np.zeros(1)}, folder / "statistics.safetensors")
    return str(folder)


def command(policy: str, robot: str = "so101_follower") -> RobotCommand:
    return RobotCommand(robot=robot, policy=policy)


@pytest.mark.parametrize("space", ["task", "erj", "era", "delta_erj"])
def test_the_dataset_of_a_policy_tells(space: str, tmp_path: Path):
    path = policy(tmp_path / "p", space=space)
    with pytest.raises(PolicyError, match=REFUSED.format(space)) as caught:
        check(command(path))
    assert "--robot.type=er_il_arm --robot.inner.type=so101_follower" in str(caught.value)
    assert f"er-il attach {path} --out" in str(caught.value)
    check(command(path, robot="er_il_arm"))
    check(RobotCommand(policy=path))  # lerobot-train, lerobot-eval: nothing moves


def test_the_dataset_of_a_policy_for_two_arms_tells(tmp_path: Path):
    path = policy(tmp_path / "p", space="erj")
    names = [f"{side}_{joint}" for side in ("l", "r") for joint in PANDA.joints]
    motors = [Motors(tuple(names[:7]), "deg"), Motors(tuple(names[7:]), "deg")]
    space = make_arm_space("erj", PANDA)
    parts = [Part(side, space, each) for side, each in zip("lr", motors, strict=True)]
    info = {"features": {"action": action_feature(Layout(tuple(names), tuple(parts)))}, "fps": 20}
    (tmp_path / "data/meta/info.json").write_text(json.dumps(info))
    with pytest.raises(PolicyError, match="trained in erj"):
        check(command(path))


def test_without_the_dataset_the_tag_tells(tmp_path: Path):
    tags = {space: Contract.of_space(make_arm_space(space, PANDA)).tag for space in ("joint", "task")}
    with pytest.raises(PolicyError, match=REFUSED.format("task")):
        check(command(policy(tmp_path / "task", tag=tags["task"])))
    check(command(policy(tmp_path / "joint", tag=tags["joint"])))


def test_a_dataset_in_lerobots_cache_tells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = policy(tmp_path / "p", space="erj")
    (tmp_path / "me").mkdir()
    (tmp_path / "data").rename(tmp_path / "me/data")
    check(command(path))  # the folder that the training read has gone: nobody else's of that name counts
    Path(path, "train_config.json").write_text(json.dumps({"dataset": {"repo_id": "me/data", "root": None}}))
    monkeypatch.setattr("lerobot.utils.constants.HF_LEROBOT_HOME", tmp_path)
    with pytest.raises(PolicyError, match="trained in erj"):
        check(command(path))


@pytest.mark.parametrize("kept", ["leader.joints", "source.action"])
def test_without_both_the_statistics_tell_that_a_policy_saves(kept: str, tmp_path: Path):
    joints, pose = [10.0, -45.0, 3.0], [0.5, 0.1, 0.3]
    for name, actions in (("task", pose), ("erj", [*pose, 10.0])):
        with pytest.raises(PolicyError, match="trained in an unknown action space"):
            check(command(policy(tmp_path / name, means={kept: joints, "action": actions})))
    check(command(policy(tmp_path / "joint", means={kept: joints, "action": [10.01, -45.0, 3.0]})))
    check(command(policy(tmp_path / "not_ours", means={"action": pose, "observation.state": joints})))


def test_joint_policies_attached_ones_and_those_of_others_pass(tmp_path: Path):
    check(command(policy(tmp_path / "joint", space="joint")))
    (tmp_path / "data/meta/info.json").unlink()
    check(command(policy(tmp_path / "others")))
    erj = Contract.of_space(make_arm_space("erj", PANDA)).tag
    attached = policy(tmp_path / "attached", tag=erj)
    steps = [{"registry_name": DECODE_POLICY_ACTION, "config": {}}]
    Path(attached, "policy_postprocessor.json").write_text(json.dumps({"steps": steps}))
    check(command(attached))
    with pytest.raises(PolicyError, match="would do it again"):
        check(command(attached, robot="er_il_arm"))
    with pytest.raises(PolicyError, match=r"policy server, without plugins.*--robot.type=er_il_arm"):
        check(RobotCommand(robot="so101_follower", policy=attached, served=True))


def test_a_policy_elsewhere_passes_with_a_warning(caplog: pytest.LogCaptureFixture):
    with caplog.at_level(logging.WARNING):
        check(command("/on/the/server"))
    assert "cannot check the actions of the policy /on/the/server" in caplog.text


def test_joints_of_a_leader_are_not_recorded_as_encoded_actions():
    leads = {"robot": "er_il_arm", "leader": "so101_leader"}
    with pytest.raises(DatasetError, match="Record them with the inner robot"):
        check(RobotCommand(**leads, dataset="me/data"))
    with pytest.raises(DatasetError, match="so101_leader gives joints"):
        check(RobotCommand(**leads, dataset="me/data", policy="p", strategy="dagger"))
    check(RobotCommand(**leads))  # lerobot-teleoperate
    check(RobotCommand(**leads, dataset="me/data", policy="p", strategy="episodic"))  # between episodes
    check(RobotCommand(robot="so101_follower", leader="so101_leader", dataset="me/data"))


def test_commands_are_read_as_lerobot_reads_them(tmp_path: Path):
    arguments = ["--robot.type=er_il_sim", "--policy.path", "p", "--strategy.type=episodic", "--robot.seed=3"]
    assert RobotCommand.read(arguments) == RobotCommand(robot="er_il_sim", policy="p", strategy="episodic")
    assert RobotCommand.read([*arguments, "--robot.type", "er_il_arm"]).robot == "er_il_arm"  # the last one counts
    client = RobotCommand.read(["--pretrained_name_or_path=p", "--robot.type=er_il_sim"])
    assert client == RobotCommand(robot="er_il_sim", policy="p", served=True)
    values = {"robot": {"type": "er_il_sim", "seed": 3}, "policy": {"path": "p"}, "fps": 20}
    for name, text in (("c.yaml", yaml.safe_dump(values)), ("c.json", json.dumps(values))):
        (tmp_path / name).write_text(text)
        assert RobotCommand.read([f"--config_path={tmp_path / name}"]) == RobotCommand(robot="er_il_sim", policy="p")
        other = RobotCommand.read([f"--config_path={tmp_path / name}", "--policy.path=q"])
        assert other.policy == "q"


def test_lerobot_imports_the_plugin_and_gets_no_further(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    path = policy(tmp_path / "p", space="erj")
    monkeypatch.setattr(sys, "argv", ["lerobot-rollout", f"--policy.path={path}", "--robot.type=so101_follower"])
    monkeypatch.delitem(sys.modules, "lerobot_env_er_il", raising=False)  # as in a process of its own
    with pytest.raises(SystemExit, match="2"):
        import_utils.register_third_party_plugins()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"error: The policy {path} was trained in erj action space")
    monkeypatch.setattr(sys, "argv", ["lerobot-rollout", f"--policy.path={path}", "--robot.type=er_il_arm"])
    importlib.import_module("lerobot_env_er_il")


def test_what_cannot_be_checked_does_not_move(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = policy(tmp_path / "p")
    Path(path, "statistics.safetensors").write_bytes(b"junk")
    with pytest.raises(SystemExit, match="2"):
        check_command([f"--policy.path={path}", "--robot.type=so101_follower"])
    assert "cannot check whether the policy's actions are joints" in capsys.readouterr().err
