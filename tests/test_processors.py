import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from lerobot.configs import FeatureType, PipelineFeatureType, PolicyFeature
from lerobot.datasets import LeRobotDataset
from lerobot.lerobot_types import RobotAction
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.factory import make_pre_post_processors
from lerobot.processor import (
    DataProcessorPipeline,
    PolicyProcessorPipeline,
    RelativeActionsProcessorStep,
    RobotActionProcessorStep,
    RobotProcessorPipeline,
)
from lerobot.processor.converters import (
    robot_action_observation_to_transition,
    transition_to_robot_action,
)
from lerobot.scripts import lerobot_record
from lerobot.utils.import_utils import register_third_party_plugins
from operating import EPISODE_TIME, right_arrow_after

from er_il import Arm
from er_il.robots.processors import DecodePolicyAction, DecodeRobotAction
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError, ShapeError

PANDA = Arm.preset("panda")
JOINTS = tuple(f"{joint}.pos" for joint in PANDA.joints)
LAYOUT = Layout(
    (*JOINTS, "gripper.pos"), (Part("", make_arm_space("erj", PANDA), Motors(JOINTS, "deg", state=JOINTS)),)
)
PERIOD = 0.05
REACH = PANDA.velocity * PERIOD
# A state in another order than the action, with more in it.
STATE_NAMES = ["gripper.pos", *JOINTS[::-1], "panda_joint1.vel"]


def vector(q: np.ndarray, gripper: float = 0.5) -> np.ndarray:
    return np.append(np.degrees(q), gripper)


def state(q: np.ndarray) -> torch.Tensor:
    named = dict(zip(LAYOUT.names, vector(q, 0.9), strict=True)) | {"panda_joint1.vel": 7.0}
    return torch.tensor([[named[name] for name in STATE_NAMES]], dtype=torch.float32)


def encoded(*q: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(LAYOUT.encode(np.array([vector(each) for each in q]))).float()


def step(on_invalid: str = "best_effort") -> DecodePolicyAction:
    return DecodePolicyAction(spec=LAYOUT.spec(), period=PERIOD, on_invalid=on_invalid, state_names=STATE_NAMES)


@pytest.fixture
def loaded(tmp_path: Path) -> tuple[Any, Any]:
    """Pre- and post-processor as LeRobot loads them with a policy: it connects the two."""
    PolicyProcessorPipeline([RelativeActionsProcessorStep()], "policy_preprocessor").save_pretrained(tmp_path)
    PolicyProcessorPipeline([step()], "policy_postprocessor").save_pretrained(tmp_path)
    return make_pre_post_processors(ACTConfig(), str(tmp_path))


def test_a_loaded_policy_decodes_from_the_measured_joints_in_degrees(loaded: tuple[Any, Any]):
    before, after = loaded
    goal = PANDA.home + 0.4 * REACH
    before({"observation.state": state(PANDA.home)})
    decoded = after(encoded(goal))
    assert decoded.shape == (1, 8)
    np.testing.assert_allclose(decoded[0], vector(goal), atol=0.06)
    # The next seed is what is measured then: an elbow elsewhere stays where it is.
    swung = PANDA.home + np.array([0.3, 0.1, -0.4, 0.0, 0.2, 0.1, -0.2])
    after.reset()
    before({"observation.state": state(swung)})
    np.testing.assert_allclose(after(encoded(swung))[0], vector(swung), atol=0.06)


def test_reset_starts_the_velocity_limit_from_the_measured_joints_again(loaded: tuple[Any, Any]):
    before, after = loaded
    far = PANDA.home + 4 * REACH
    before({"observation.state": state(PANDA.home)})
    for _ in range(2):
        told = after(encoded(far))
    np.testing.assert_allclose(np.radians(told[0, :7]) - PANDA.home, 2 * REACH, atol=2e-3)
    after.reset()
    np.testing.assert_allclose(np.radians(after(encoded(far))[0, :7]) - PANDA.home, REACH, atol=2e-3)


def test_a_chunk_is_decoded_along_its_way_from_the_measured_joints(loaded: tuple[Any, Any]):
    before, after = loaded
    way = [PANDA.home + share * REACH for share in (0.5, 1.0, 1.5)]
    before({"observation.state": state(PANDA.home)})
    for _ in range(2):  # each chunk anew, however far the one before it led
        decoded = after(encoded(*way)[None])
        assert decoded.shape == (1, 3, 8)
        np.testing.assert_allclose(decoded[0], [vector(q) for q in way], atol=0.06)


def test_a_chunk_in_single_calls_is_decoded_as_in_one(loaded: tuple[Any, Any]):
    """LeRobot's policy server observes once, then post-processes a chunk's actions one after the other."""
    before, after = loaded
    phase = np.linspace(0.0, 2.5, 50)[:, None]
    way = PANDA.home + 0.5 * np.sin(phase * np.array([1.0, 0.7, -0.9, 0.8, 1.1, -0.6, 1.2]))  # up to 28 degrees away
    for _ in range(2):  # the next chunk starts from its own observation, however far the one before it led
        before({"observation.state": state(way[0])})
        single = np.array([after(action[None])[0].numpy() for action in encoded(*way)])
        np.testing.assert_allclose(single, [vector(q) for q in way], atol=0.1)
        np.testing.assert_allclose(single, after(encoded(*way)[None])[0], atol=1e-4)


def test_the_step_says_what_is_missing(loaded: tuple[Any, Any]):
    before, after = loaded
    with pytest.raises(ErIlError, match="knows no state"):
        after(encoded(PANDA.home))
    before({"observation.state": state(PANDA.home)[:, :3]})
    with pytest.raises(ShapeError, match="The state"):
        after(encoded(PANDA.home))
    before({"observation.state": state(PANDA.home)})
    with pytest.raises(ShapeError, match="a robot is decoded for alone"):
        after(encoded(PANDA.home, PANDA.home))
    with pytest.raises(ErIlError, match=r"does not measure panda_joint1\.pos"):
        DecodePolicyAction(spec=LAYOUT.spec(), period=PERIOD, state_names=["gripper.pos", *JOINTS[1:]])


def test_features_change_from_encoded_to_joint_positions():
    number = PolicyFeature(FeatureType.ACTION, (1,))
    named = {PipelineFeatureType.ACTION: dict.fromkeys([*LAYOUT.encoded_names, "base.vel"], number)}
    changed = DecodeRobotAction(spec=LAYOUT.spec(), period=PERIOD).transform_features(named)
    assert list(changed[PipelineFeatureType.ACTION]) == ["base.vel", *LAYOUT.names]
    policy = {PipelineFeatureType.ACTION: {"action": PolicyFeature(FeatureType.ACTION, (9,))}}
    assert step().transform_features(policy)[PipelineFeatureType.ACTION]["action"].shape == (8,)


class EncodeStep(RobotActionProcessorStep):
    """What a teleoperator that commands in ERJ would give; here made of the scripted leader's joints."""

    def action(self, action: RobotAction) -> RobotAction:
        (row,) = LAYOUT.encode([[action[name] for name in LAYOUT.names]])
        return dict(zip(LAYOUT.encoded_names, row.tolist(), strict=True))

    def transform_features(self, features: Any) -> Any:
        number = PolicyFeature(FeatureType.ACTION, (1,))
        return features | {PipelineFeatureType.ACTION: dict.fromkeys(LAYOUT.encoded_names, number)}


def pipeline(action_step: Any) -> Any:
    return RobotProcessorPipeline(
        [action_step],
        to_transition=robot_action_observation_to_transition,
        to_output=transition_to_robot_action,
    )


@pytest.mark.slow
def test_stock_record_takes_erj_actions_and_moves_the_joints(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    register_third_party_plugins()
    root = tmp_path / "data"
    decode = pipeline(DecodeRobotAction(spec=LAYOUT.spec(), period=PERIOD))
    decode.save_pretrained(tmp_path / "pipeline", config_filename="decode.json")
    again = DataProcessorPipeline.from_pretrained(
        tmp_path / "pipeline", config_filename="decode.json",
        to_transition=robot_action_observation_to_transition, to_output=transition_to_robot_action,
    )  # fmt: skip
    arguments = ["--robot.type=er_il_sim", "--robot.camera_names=[]", "--teleop.type=er_il_scripted_leader"]
    arguments += ["--dataset.repo_id=me/erj", f"--dataset.root={root}", "--dataset.fps=60", "--dataset.num_episodes=1"]
    arguments += [f"--dataset.episode_time_s={EPISODE_TIME}", "--dataset.single_task=Reach."]
    arguments += ["--dataset.push_to_hub=false", "--play_sounds=false"]
    monkeypatch.setattr(sys, "argv", ["record", *arguments])
    with right_arrow_after(100):
        lerobot_record.record(teleop_action_processor=pipeline(EncodeStep()), robot_action_processor=again)
    dataset = LeRobotDataset("me/erj", root=root)
    assert dataset.features["action"]["names"] == list(LAYOUT.encoded_names)
    rows = dataset.hf_dataset.with_format("numpy")[:]
    q = np.radians(rows["observation.state"][:, :7])
    assert np.ptp(q[:, 0]) > 0.2  # [rad] it moved
    commanded = rows["action"][:-1, :3]
    reached = np.array([LAYOUT.parts[0].space.fk(each)[:3, 3] for each in q[1:]])
    assert np.max(np.linalg.norm(reached - commanded, axis=1)) < 0.03  # [m] servos lag
