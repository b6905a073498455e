"""``--robot.type=er_il_arm``: the decoder inside a robot, on simulated ones."""

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import draccus
import gymnasium
import numpy as np
import pytest
import torch
from lerobot.robots import Robot, RobotConfig, make_robot_from_config

from er_il import Arm
from er_il.datasets.schema import action_feature
from er_il.envs.decoders import Decoder
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import make_action_space_env
from er_il.robots.hardware import DecodingRobot, DecodingRobotConfig, SimFollower, SimFollowerConfig
from er_il.robots.hardware.calibration import NeedsNoCalibration
from er_il.robots.hardware.pace import ACTIONS, Pace
from er_il.robots.processors import DecodePolicyAction
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError

PANDA = Arm.preset("panda")
JOINTS = tuple(f"{joint}.pos" for joint in PANDA.joints)
NAMES = (*JOINTS, "gripper.pos")
FPS = 20


def layout(space: str, units: str = "deg") -> Layout:
    return Layout(NAMES, (Part("", make_arm_space(space, PANDA), Motors(JOINTS, units, state=JOINTS)),))


def dataset(folder: Path, layout: Layout) -> Path:
    """What describes a dataset's actions."""
    (folder / "meta").mkdir(parents=True)
    info = {"fps": FPS, "features": {"action": action_feature(layout)}}
    (folder / "meta/info.json").write_text(json.dumps(info))
    return folder


def sim(**options: Any) -> SimFollowerConfig:
    return SimFollowerConfig(camera_names=[], **options)


def robot(inner: RobotConfig | None = None, **options: Any) -> DecodingRobot:
    built = make_robot_from_config(DecodingRobotConfig(inner=inner or sim(), **options))
    assert isinstance(built, DecodingRobot)
    return built


def sent_to(inner: Robot, monkeypatch: pytest.MonkeyPatch) -> list[dict[str, float]]:
    """What a robot is told from now on."""
    sent, send = [], inner.send_action
    monkeypatch.setattr(inner, "send_action", lambda action: sent.append(action) or send(action))
    return sent


def demonstration(seed: int) -> np.ndarray:
    """The joints [rad] and the gripper (T, 8) of the scripted leader."""
    env = gymnasium.make(task_id("reach_cup"))
    env.reset(seed=seed)
    return np.array(list(env.unwrapped.leader(seed)))


def in_degrees(vectors: np.ndarray) -> np.ndarray:
    return np.column_stack([np.degrees(vectors[:, :-1]), vectors[:, -1]])


@pytest.fixture(scope="module")
def shown() -> np.ndarray:
    return demonstration(3)


def from_eval(actions: np.ndarray, space: str) -> np.ndarray:
    env = make_action_space_env("reach_cup", Decoder(space), max_episode_steps=-1)
    env.reset(seed=3)
    return np.array([env.step(action)[4]["command"] for action in actions])


def from_attach(actions: np.ndarray, layout: Layout) -> np.ndarray:
    follower = SimFollower(sim(seed=3))
    follower.connect()
    names = list(follower.observation_features)
    step = DecodePolicyAction(spec=layout.spec(), period=1 / FPS, state_names=names)
    told = []
    for action in actions:
        state = torch.tensor([[follower.get_observation()[name] for name in names]])
        step.relative_step = type("Kept", (), {"get_cached_state": lambda self, state=state: state})()
        (decoded,) = step({"action": torch.from_numpy(action)[None]})["action"]
        told.append(decoded.numpy())
        follower.send_action(dict(zip(NAMES, decoded.tolist(), strict=True)))
    follower.disconnect()
    return np.radians(np.array(told)[:, :-1])


def from_robot(actions: np.ndarray, monkeypatch: pytest.MonkeyPatch, **options: Any) -> np.ndarray:
    arm = robot(sim(seed=3), **options)
    sent = sent_to(arm._inner, monkeypatch)
    arm.connect()
    for action in actions:
        arm.get_observation()
        arm.send_action(dict(zip(arm.action_features, action.tolist(), strict=True)))
    arm.disconnect()
    return np.radians(np.array([[action[name] for name in JOINTS] for action in sent]))


@pytest.mark.parametrize("space", ["erj", "era", "task"])
def test_robot_attachment_and_evaluation_tell_the_arm_the_same_joints(
    space: str, shown: np.ndarray, monkeypatch: pytest.MonkeyPatch
):
    actions = layout(space).encode(in_degrees(shown[:60]))
    actions[20:25, 2] += 0.3  # [m] beyond what the arm does in a period, partly beyond its reach
    actions[40, 0] = np.nan
    actions = actions.astype(np.float32)
    evaluated = from_eval(actions, space)
    assert np.ptp(evaluated, axis=0).max() > 0.2  # [rad] it moves
    robots = from_robot(actions, monkeypatch, arm="panda", action_space=space, fps=FPS)
    np.testing.assert_allclose(robots, evaluated, atol=2e-4)
    np.testing.assert_allclose(from_attach(actions, layout(space)), evaluated, atol=2e-4)


def test_a_chunk_is_decoded_from_the_joints_at_each_action_though_nobody_observes(
    shown: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """The asynchronous client observes when its queue runs low."""
    arm = robot(sim(seed=3), spec=str(dataset(tmp_path / "erj", layout("erj"))))
    sent = sent_to(arm._inner, monkeypatch)
    arm.connect()
    arm.get_observation()
    for action in arm._layout.encode(in_degrees(shown[:50])):
        arm.send_action(dict(zip(arm.action_features, action.tolist(), strict=True)))
    arm.disconnect()
    told = np.array([list(action.values()) for action in sent])
    np.testing.assert_allclose(told, in_degrees(shown[:50]), atol=0.1)


def test_names_are_those_of_the_dataset_and_what_the_rollout_passes_on(tmp_path: Path):
    arm = robot(spec=str(dataset(tmp_path / "erj", layout("erj"))))
    assert list(arm.action_features)[-3:] == ["ee.qw.pos", "panda_joint1.pos", "gripper.pos"]
    assert arm.observation_features == arm._inner.observation_features  # the policy's state, as it was trained
    arm.connect()
    seen = arm.get_observation()
    measured = np.array([[seen[name] for name in NAMES]])
    (action,) = arm._layout.encode(measured)
    sent = arm.send_action(dict(zip(arm._layout.encoded_names, action, strict=True)))  # as lerobot-replay names them
    assert list(sent) == list(arm.action_features)
    back = arm.send_action(seen | {"ee.x.pos": 0.0})  # LeRobot's way back: everything that ends with .pos
    np.testing.assert_allclose([back[name] for name in NAMES], measured[0], atol=1e-4)
    with pytest.raises(ErIlError, match=r"lacks ee\.qw; it has .* takes ee\.x\.pos"):
        arm.send_action(dict.fromkeys(set(arm._layout.encoded_names) - {"ee.qw"}, 0.0))
    arm.disconnect()
    assert not arm.is_connected


def test_joint_actions_keep_the_arms_limits_too(monkeypatch: pytest.MonkeyPatch):
    arm = robot(sim(seed=3), arm="panda", action_space="joint", fps=FPS)
    sent = sent_to(arm._inner, monkeypatch)
    arm.connect()
    seen = arm.get_observation()
    arm.send_action({name: seen[name] + 30.0 for name in JOINTS} | {"gripper.pos": 1.0})
    steps = np.radians([sent[0][name] - seen[name] for name in JOINTS]) * FPS / PANDA.velocity
    assert np.max(np.abs(steps)) == pytest.approx(1.0, abs=1e-3)  # of a period's way at full speed
    arm.disconnect()


@RobotConfig.register_subclass("test_two_arms")
@dataclass(kw_only=True)
class TwoArmsConfig(RobotConfig):
    pass


class TwoArms(NeedsNoCalibration, Robot):
    """Two Pandas that are at once where they are told, the right one's second joint reversed and offset."""

    config_class = TwoArmsConfig
    name = "test_two_arms"

    def __init__(self, config: TwoArmsConfig) -> None:
        super().__init__(config)
        joints = [f"{side}_{i}.pos" for i in range(1, 8) for side in ("left", "right")]  # interleaved
        home = np.degrees(np.repeat(PANDA.home, 2))
        self.values = dict(zip(joints, home.tolist(), strict=True)) | {"left_gripper.pos": 0.0}
        self.values["right_2.pos"] = -(self.values["right_2.pos"] - 10.0)
        self.is_here = False

    @property
    def observation_features(self) -> dict[str, Any]:
        return dict.fromkeys(self.values, float) | {"top": (4, 4, 3)}

    @property
    def action_features(self) -> dict[str, Any]:
        return dict.fromkeys(self.values, float)

    @property
    def is_connected(self) -> bool:
        return self.is_here

    def connect(self, calibrate: bool = True) -> None:
        self.is_here = True

    def disconnect(self) -> None:
        self.is_here = False

    def get_observation(self) -> dict[str, Any]:
        return self.values | {"top": np.zeros((4, 4, 3), dtype=np.uint8)}

    def send_action(self, action: dict[str, float]) -> dict[str, float]:
        assert set(action) <= set(self.values)
        self.values |= action
        return action


ARMS = """
left: {arm: panda, units: deg, joints: [left_1.pos, left_2.pos, left_3.pos, left_4.pos, left_5.pos, left_6.pos, \
left_7.pos]}
right: {arm: panda, units: deg, joints: [right_1.pos, right_2.pos, right_3.pos, right_4.pos, right_5.pos, right_6.pos, \
right_7.pos], signs: [1, -1, 1, 1, 1, 1, 1], offsets: [0, 10, 0, 0, 0, 0, 0]}
"""


def test_two_arms_by_a_file_with_signs_and_offsets(tmp_path: Path):
    (tmp_path / "arms.yaml").write_text(ARMS)
    arms = robot(TwoArmsConfig(), arms=str(tmp_path / "arms.yaml"), fps=FPS, rotation="rot6d")
    arms.connect()
    assert len(arms.action_features) == 2 * 10 + 1
    left, right = (part.space for part in arms._layout.parts)
    goals = PANDA.home + 0.02, PANDA.home - 0.03
    encoded = [space.encode(goal[None])[0] for space, goal in zip((left, right), goals, strict=True)]
    for _ in range(10):
        arms.send_action(dict(zip(arms.action_features, [*encoded[0], *encoded[1], 0.7], strict=True)))
    inner = arms._inner
    assert isinstance(inner, TwoArms)
    told = {side: np.radians([inner.values[f"{side}_{i}.pos"] for i in range(1, 8)]) for side in ("left", "right")}
    told["right"][1] = -told["right"][1] + np.radians(10.0)
    for side, goal in zip(("left", "right"), goals, strict=True):
        np.testing.assert_allclose(told[side], goal, atol=2e-3)
    assert inner.values["left_gripper.pos"] == 0.7


@dataclass
class Command:
    robot: RobotConfig


def test_the_options_of_the_inner_robot_nest():
    options = ["--robot.type=er_il_arm", "--robot.inner.type=er_il_sim", "--robot.inner.task=push_button_elbow"]
    options += ["--robot.inner.camera_names=[]", "--robot.spec=somewhere", "--robot.on_invalid=stop"]
    parsed = draccus.parse(Command, args=options).robot
    assert parsed == DecodingRobotConfig(inner=sim(task="push_button_elbow"), spec="somewhere", on_invalid="stop")
    with pytest.raises(SystemExit):  # it holds no other of its kind
        draccus.parse(Command, args=["--robot.type=er_il_arm", "--robot.inner.type=er_il_arm"])


def test_mistakes_are_told_before_anything_moves(tmp_path: Path):
    erj = str(dataset(tmp_path / "erj", layout("erj")))
    for options, message in [
        ({}, "--robot.spec .*--robot.arm .*--robot.arms"),
        ({"spec": erj, "arm": "panda"}, "Give one of"),
        ({"arm": "panda"}, "--robot.fps"),
        ({"arm": "xarm7", "fps": FPS}, "Which dimensions are the joints of xarm7.*panda_joint1.pos"),
        ({"spec": str(tmp_path)}, "No policy at"),
        ({"spec": str(dataset(tmp_path / "other", other_robot()))}, r"takes no left\.pos.*it takes panda_joint1\.pos"),
        ({"arm": "panda", "fps": FPS, "on_invalid": "panic"}, "best_effort, hold, stop"),
    ]:
        with pytest.raises((ErIlError, ValueError), match=message):
            robot(**options)


def other_robot() -> Layout:
    return Layout((*JOINTS, "left.pos"), layout("erj").parts)


def test_an_arm_measured_in_other_units_is_not_moved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    arm = robot(spec=str(dataset(tmp_path / "rad", layout("erj", "rad"))))
    sent = sent_to(arm._inner, monkeypatch)
    with pytest.raises(ErIlError, match=r"panda_joint1\.pos .*limits of panda: check its units \(rad\)"):
        arm.connect()
    assert not arm.is_connected
    assert not sent


def test_the_commands_policy_says_what_actions_mean_and_is_refused_if_it_acts_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    policy = tmp_path / "policy"
    policy.mkdir()
    root = dataset(tmp_path / "era", layout("era"))
    (policy / "train_config.json").write_text(json.dumps({"dataset": {"root": str(root)}}))
    config = {"type": "act", "output_features": {"action": {"type": "ACTION", "shape": [9]}}}
    (policy / "config.json").write_text(json.dumps(config))
    monkeypatch.setattr(sys, "argv", ["lerobot-rollout", f"--policy.path={policy}"])
    assert "arm_angle.pos" in robot().action_features
    with pytest.raises(ValueError, match=r"trained for other actions \(er_il:era.*than the robot takes \(er_il:erj"):
        robot(arm="panda", fps=FPS)
    (root / "meta/info.json").unlink()  # its length is left to tell
    with pytest.raises(ValueError, match=r"\(9 dimensions\) than the robot takes \(8 dimensions\)"):
        robot(arm="panda", fps=FPS, action_space="task")
    robot(arm="panda", fps=FPS, action_space="era")
    config["tags"] = ["er_il:era/panda/panda_hand_tcp/quat/-"]
    (policy / "config.json").write_text(json.dumps(config))
    with pytest.raises(ValueError, match=r"\(er_il:era.*\(er_il:erj"):
        robot(arm="panda", fps=FPS)


def test_actions_that_come_too_fast_are_told_once(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture):
    for rate, told in ((20.0, 0), (22.0, 0), (30.0, 1)):
        caplog.clear()
        clock = iter(np.arange(3 * ACTIONS) / rate)
        monkeypatch.setattr(time, "monotonic", lambda clock=clock: next(clock))
        pace = Pace(20.0)
        for _ in range(3 * ACTIONS):
            pace.tick()
        assert len(caplog.records) == told
