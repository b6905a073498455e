"""Franka arms as LeRobot hardware, over the arms' own protocol, on simulated control boxes."""

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from documented import ROOT, documented
from lerobot.datasets import LeRobotDataset
from lerobot.scripts import lerobot_record
from operating import EPISODE_TIME, right_arrow_after
from simulated_franka import COMMAND_PORT, STARTS_WITHIN, SimulatedFranka, server_environment

from er_il import cli
from er_il.arms.arm import Arm
from er_il.robots.hardware import FrankaFollower, FrankaFollowerConfig
from er_il.robots.hardware.franka_arm import FrankaArm
from er_il.spaces.layout import Layout
from er_il.support.errors import ReflexError, RobotError

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quiet_logging")]

WORKER = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")  # each has addresses of its own
FOLLOWER, LEADER = f"127.0.1{WORKER}.1", f"127.0.1{WORKER}.2"
HOME = Arm.preset("fr3").home
REACH = np.array([0.3, 0.2, -0.2, 0.3, 0.2, 0.2, 0.2])  # [rad]
STEPS = 60  # at 20 Hz


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    try:
        return server_environment(tmp_path_factory.getbasetemp() / "franka-sim")
    except (RuntimeError, subprocess.CalledProcessError):
        pytest.skip("The simulated control box cannot be installed: there is no uv, or no network.")


@pytest.fixture(autouse=True)
def ordinary_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("franka")
    monkeypatch.setenv("FRANKA_REALTIME", "ignore")
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)


def run(main: object, *arguments: str) -> None:
    """Run a command in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["command", *arguments])
        main()


def send(robot: FrankaFollower, q: np.ndarray, seconds: float) -> None:
    """Send the same target q (7,) [rad] again and again."""
    action = dict(zip(robot.action_features, [*np.degrees(q).tolist(), 1.0], strict=True))
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        robot.send_action(action)
        time.sleep(0.02)


def test_a_guided_arm_is_mirrored_recorded_and_encoded(python: Path, tmp_path: Path):
    times = np.linspace(0.0, 3.0, 100)
    along = 0.5 - 0.5 * np.cos(np.pi * np.clip(times / 2.0, 0.0, 1.0))
    path = np.column_stack([times, HOME + np.outer(along, REACH), 0.08 - 0.06 * along])
    np.savetxt(tmp_path / "path.csv", path, delimiter=",")
    dataset = ["--dataset.repo_id=me/reach", f"--dataset.root={tmp_path / 'reach'}", "--dataset.single_task=Reach."]
    dataset += ["--dataset.fps=20", "--dataset.num_episodes=1", f"--dataset.episode_time_s={EPISODE_TIME}"]
    with SimulatedFranka(python, tmp_path, FOLLOWER), SimulatedFranka(python, tmp_path, LEADER) as leader:
        leader.tell(f"guide {tmp_path / 'path.csv'}")
        with right_arrow_after(STEPS):
            run(lerobot_record.main, "--robot.type=er_il_franka", f"--robot.address={FOLLOWER}", "--robot.speed=1",
                "--teleop.type=er_il_franka_leader", f"--teleop.address={LEADER}", *dataset,
                "--dataset.push_to_hub=false", "--play_sounds=false")  # fmt: skip
    columns = LeRobotDataset("me/reach", root=tmp_path / "reach").hf_dataset.with_format("numpy")[:]
    action, state = columns["action"], columns["observation.state"]
    end = [*np.degrees(HOME + REACH), 0.25]
    np.testing.assert_allclose(action[-1], end, atol=0.5)
    np.testing.assert_allclose(state[-1], end, atol=1.5)
    encode = ["encode", str(tmp_path / "reach"), "--to", "erj", "--arm", "fr3", "--units", "deg"]
    run(cli.main, *encode, "--out", str(tmp_path / "erj"))
    encoded = LeRobotDataset("me/reach_erj", root=tmp_path / "erj")
    layout = Layout.from_spec(encoded.features["action"]["info"]["er_il"])
    np.testing.assert_allclose(encoded.hf_dataset.with_format("numpy")[:]["action"], layout.encode(action), atol=1e-4)


def test_lost_packets_stop_the_arm_and_connecting_recovers_it(python: Path, tmp_path: Path):
    with SimulatedFranka(python, tmp_path, FOLLOWER, strict=True) as box:
        robot = FrankaFollower(FrankaFollowerConfig(address=FOLLOWER, speed=0.5))
        robot.connect()
        send(robot, HOME + REACH, 0.3)
        box.tell("lose 0.3")
        with pytest.raises(ReflexError, match=r"communication_constraints_violation.*Packets were lost"):
            send(robot, HOME + REACH, 5.0)
        time.sleep(0.5)
        q = box.states()[:, 2:9]
        np.testing.assert_allclose(q[-1], q[-20], atol=1e-3)  # it holds
        robot.connect()
        robot.disconnect()


def test_a_control_box_that_is_gone_is_told(python: Path, tmp_path: Path):
    robot = FrankaFollower(FrankaFollowerConfig(address=FOLLOWER))
    with SimulatedFranka(python, tmp_path, FOLLOWER) as box:
        robot.connect()
        send(robot, HOME + REACH, 0.3)
        box.kill()
        with pytest.raises(RobotError, match=f"no connection to {FOLLOWER}"):
            send(robot, HOME + REACH, 5.0)
    assert not robot.is_connected
    with pytest.raises(RobotError, match=f"no connection to {FOLLOWER}"):
        robot.connect()


def test_the_arm_is_where_it_was_told_to_be_and_no_faster_than_allowed(python: Path, tmp_path: Path):
    with SimulatedFranka(python, tmp_path, FOLLOWER) as box:
        robot = FrankaFollower(FrankaFollowerConfig(address=FOLLOWER, speed=0.5))
        robot.connect()
        send(robot, HOME + 2 * REACH, 3.0)
        robot.disconnect()
        states = box.states()
    np.testing.assert_allclose(states[-1, 2:9], HOME + 2 * REACH, atol=0.01)
    speed = np.abs((states[10:, 2:9] - states[:-10, 2:9]) / (states[10:, :1] - states[:-10, :1]))
    assert np.all(speed.max(axis=0) < 0.6 * Arm.preset("fr3").velocity)


def test_the_documented_commands_start_a_control_box(python: Path, tmp_path: Path):
    script, *arguments = documented("docs/real_arm.md", "python benchmarks/franka_model.py")
    subprocess.run([sys.executable, ROOT / script, *arguments], cwd=tmp_path, check=True)
    script, *arguments = documented("docs/real_arm.md", "franka-sim/bin/python benchmarks/franka_server.py")
    address = arguments[-1]
    server = subprocess.Popen([python, ROOT / script, *arguments], cwd=tmp_path, stdin=subprocess.PIPE)
    try:
        until = time.monotonic() + STARTS_WITHIN
        while socket.socket().connect_ex((address, COMMAND_PORT)) and time.monotonic() < until:
            time.sleep(0.1)
        arm = FrankaArm(address)
        np.testing.assert_allclose(arm.measure(), HOME, atol=0.01)
        arm.close()
    finally:
        server.kill()
        server.wait()
