import json
from pathlib import Path

import pytest
from lerobot.policies.act.configuration_act import ACTConfig

from er_il import Arm
from er_il.datasets.schema import action_feature
from er_il.envs.contract import Contract, check_policy, policy_contract
from er_il.spaces.action_space import ActionSpace
from er_il.spaces.layout import Layout
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import PolicyError
from er_il.support.resources import data_dir

PANDA = Arm.preset("panda")
SPACES = {kind: make_arm_space(kind, PANDA) for kind in ("joint", "task", "erj")}


def policy(folder: Path, *, tags: list[str] | None = None, dataset: Path | None = None) -> Path:
    """A policy's folder as LeRobot's training leaves it, but for the weights."""
    folder.mkdir()
    ACTConfig(device="cpu", tags=tags).save_pretrained(folder)
    (folder / "train_config.json").write_text(json.dumps({"dataset": {"root": str(dataset) if dataset else None}}))
    return folder


def dataset(folder: Path, space: ActionSpace) -> Path:
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(
        json.dumps({"features": {"action": action_feature(Layout.of_space(space))}})
    )
    return folder


def test_the_tag_says_everything_that_actions_depend_on():
    assert Contract.of_space(SPACES["erj"]).tag == "er_il:erj/panda/panda_hand_tcp/quat/panda_joint1"
    assert Contract.of_space(SPACES["task"]).tag == "er_il:task/panda/panda_hand_tcp/quat/-"
    assert Contract.of_space(SPACES["joint"]).tag == "er_il:joint/panda/panda_hand_tcp/-/-"
    other_joint = Arm.from_urdf(PANDA.urdf, ee_frame="panda_link8", redundant=["panda_joint3"], name="panda")
    assert Contract.of_space(make_arm_space("erj", other_joint, rotation="rot6d")).tag == (
        "er_il:erj/panda/panda_link8/rot6d/panda_joint3"
    )


@pytest.mark.parametrize("kind", SPACES)
def test_a_tag_survives_the_policys_config(tmp_path: Path, kind: str):
    contract = Contract.of_space(SPACES[kind])
    assert policy_contract(policy(tmp_path / "p", tags=["act", contract.tag])) == contract
    check_policy(tmp_path / "p", SPACES[kind])


@pytest.mark.parametrize("kind", SPACES)
@pytest.mark.parametrize("suffix", ["", "_images", "_images_small"])
def test_the_shipped_configurations_carry_their_tag(kind: str, suffix: str):
    text = (data_dir("configs") / f"act_{kind}{suffix}.yaml").read_text()
    assert f'tags: ["{Contract.of_space(SPACES[kind]).tag}"]' in text


def test_a_policy_of_equal_length_but_another_space_is_refused(tmp_path: Path):
    joint = policy(tmp_path / "p", tags=[Contract.of_space(SPACES["joint"]).tag])
    assert SPACES["joint"].dim == SPACES["task"].dim
    with pytest.raises(PolicyError, match="space 'joint' not 'task'"):
        check_policy(joint, SPACES["task"])


@pytest.mark.parametrize(
    ("tag", "complaint"),
    [
        ("er_il:task/openarm/panda_hand_tcp/quat/-", "arm 'openarm' not 'panda'"),
        ("er_il:task/panda/panda_hand/quat/-", "frame 'panda_hand' not 'panda_hand_tcp'"),
        ("er_il:task/panda/panda_hand_tcp/rot6d/-", "rotation 'rot6d' not 'quat'"),
    ],
)
def test_another_arm_frame_or_rotation_is_refused(tmp_path: Path, tag: str, complaint: str):
    with pytest.raises(PolicyError, match=complaint):
        check_policy(policy(tmp_path / "p", tags=[tag]), SPACES["task"])


def test_the_dataset_outranks_a_tag_and_stands_in_for_one(tmp_path: Path):
    task = dataset(tmp_path / "data", SPACES["task"])
    copied = policy(tmp_path / "copied", tags=[Contract.of_space(SPACES["joint"]).tag], dataset=task)
    silent = policy(tmp_path / "silent", dataset=task)
    for trained in (copied, silent):
        check_policy(trained, SPACES["task"])
    moved = policy(tmp_path / "moved", tags=[Contract.of_space(SPACES["erj"]).tag], dataset=tmp_path / "gone")
    check_policy(moved, SPACES["erj"])


@pytest.mark.parametrize("tags", [None, ["act"], ["er_il:erj"], ["er_il:erj/panda/panda_hand_tcp/quat"]])
def test_a_policy_that_declares_nothing_is_refused_with_the_way_out(tmp_path: Path, tags: list[str] | None):
    with pytest.raises(PolicyError, match=r"--policy\.tags=.*er_il:erj/panda/panda_hand_tcp/quat/panda_joint1"):
        policy_contract(policy(tmp_path / "p", tags=tags))


def test_no_policy_at_all(tmp_path: Path):
    with pytest.raises(PolicyError, match="No policy at"):
        policy_contract(tmp_path)
