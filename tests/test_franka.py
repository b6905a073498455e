"""Franka arms as LeRobot hardware: the driver against a fake of franka-rs, and er_il's own limits."""

import json
import logging
import re
import subprocess
import sys
import time
from collections.abc import Generator
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from documented import ROOT
from lerobot.robots import RobotConfig, make_robot_from_config
from lerobot.teleoperators import TeleoperatorConfig, make_teleoperator_from_config
from lerobot.utils.errors import DeviceNotConnectedError

from er_il.arms.arm import Arm
from er_il.kinematics.forward import forward_of
from er_il.robots.hardware import FrankaFollower, FrankaFollowerConfig, FrankaLeader, FrankaLeaderConfig
from er_il.robots.hardware.franka_arm import FrankaArm
from er_il.robots.hardware.franka_follower import MARGIN
from er_il.robots.hardware.joint_guard import JointGuard
from er_il.robots.hardware.watchdog import Watchdog
from er_il.support.errors import ErIlError, NumbersError, ReflexError, RobotError, UnknownNameError

FR3 = Arm.preset("fr3")
NAMES = [*(f"fr3_joint{i}.pos" for i in range(1, 8)), "gripper.pos"]


class FrankaError(Exception):
    def __init__(self, kind: str, message: str = "said") -> None:
        super().__init__(message)
        self.kind = kind


class ControlException(FrankaError):  # noqa: N818 franka-rs calls it so
    def __init__(self, *errors: str) -> None:
        super().__init__("control", "aborted")
        self.errors = list(errors)


class FakeHand:
    def __init__(self) -> None:
        self.width, self.max_width, self.blocked_at = 0.08, 0.0, 0.0
        self.commands: list[tuple[str, float]] = []

    def read_once(self) -> SimpleNamespace:
        time.sleep(0.002)
        return SimpleNamespace(width=self.width, max_width=self.max_width)

    def homing(self) -> bool:
        self.max_width = 0.08
        return True

    def move(self, width: float, speed: float) -> bool:
        self.commands.append(("move", width))
        self.width = max(width, self.blocked_at)
        return self.width == width

    def grasp(self, width: float, speed: float, force: float, inner: float, outer: float) -> bool:
        self.commands.append(("grasp", force))
        return True


class FakeTargets:
    """A loop that is at its target at once."""

    def __init__(self, box: "FakeRobot") -> None:
        self.box, self.running, self.failure = box, True, None

    def state(self) -> SimpleNamespace:
        return self.box.state()

    def move_to(self, q: Any) -> None:
        if not self.running:
            raise FrankaError("invalid_operation")
        self.box.targets.append(np.array(q))
        self.box.q = np.array(q)

    def stop(self) -> None:
        self.running = False
        if self.failure is not None:
            raise self.failure


class FakeRobot:
    """A control box that remembers what it was told."""

    def __init__(self) -> None:
        self.q, self.mode, self.fci_version = FR3.home.copy(), "idle", 10
        self.targets: list[np.ndarray] = []
        self.loops: list[FakeTargets] = []
        self.asked: dict[str, Any] = {}
        self.hand = FakeHand()

    def state(self) -> SimpleNamespace:
        return SimpleNamespace(q=self.q, dq=np.zeros(7), robot_mode=self.mode)

    read_once = state

    def gripper(self) -> FakeHand:
        return self.hand

    def automatic_error_recovery(self) -> None:
        self.asked["recovered"] = True
        self.mode = "idle"

    def set_collision_behavior_simple(self, *thresholds: list[float]) -> None:
        self.asked["thresholds"] = thresholds

    def joint_targets(self, **options: Any) -> FakeTargets:
        self.asked |= options
        self.loops.append(FakeTargets(self))
        return self.loops[-1]

    def abort(self, failure: FrankaError) -> None:
        self.mode = "reflex"
        self.loops[-1].running, self.loops[-1].failure = False, failure


@pytest.fixture
def box(monkeypatch: pytest.MonkeyPatch) -> FakeRobot:
    """The one control box in the network."""
    robot = FakeRobot()
    library = ModuleType("franka")
    library.FrankaError, library.ControlException = FrankaError, ControlException
    library.Robot = lambda address: robot
    monkeypatch.setitem(sys.modules, "franka", library)
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)  # what connecting does to it is undone
    return robot


@pytest.fixture
def follower(box: FakeRobot) -> Generator[FrankaFollower]:
    robot = FrankaFollower(FrankaFollowerConfig(address="fake", speed=0.5, timeout=0.2))
    robot.connect()
    yield robot
    robot.disconnect()


def action(q: np.ndarray, opening: float = 1.0) -> dict[str, float]:
    return dict(zip(NAMES, [*np.degrees(q).tolist(), opening], strict=True))


def test_the_fr3_is_a_panda_with_other_limits():
    panda = Arm.preset("panda")
    q = np.random.default_rng(0).uniform(panda.lower, panda.upper, (50, 7))
    np.testing.assert_allclose(forward_of(FR3).fk_batch(q), forward_of(panda).fk_batch(q), atol=1e-12)
    # Numbers of the published description, which differ from the Panda's in every joint.
    np.testing.assert_array_equal(FR3.velocity, [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
    np.testing.assert_array_equal(FR3.lower[[3, 5]], [-3.0421, 0.5445])
    assert not np.isclose(FR3.lower, panda.lower).any()


def test_lerobot_makes_both_devices_by_their_types(box: FakeRobot):
    config = RobotConfig.get_choice_class("er_il_franka")(address="fake")
    robot = make_robot_from_config(config)
    leader = make_teleoperator_from_config(TeleoperatorConfig.get_choice_class("er_il_franka_leader")(address="fake"))
    assert isinstance(robot, FrankaFollower) and isinstance(leader, FrankaLeader)
    assert list(robot.action_features) == list(robot.observation_features) == list(leader.action_features) == NAMES
    bare = FrankaFollower(FrankaFollowerConfig(address="fake", gripper=False))
    assert list(bare.action_features) == NAMES[:-1]


def test_the_follower_speaks_degrees_and_openings(follower: FrankaFollower, box: FakeRobot):
    box.hand.width = 0.02
    time.sleep(0.05)
    observed = follower.get_observation()
    np.testing.assert_allclose([observed[name] for name in NAMES], [*np.degrees(FR3.home), 0.25])
    sent = follower.send_action(action(FR3.home + 1e-5, opening=0.5))
    np.testing.assert_allclose(list(sent.values()), [*np.degrees(FR3.home + 1e-5), 0.5])
    np.testing.assert_allclose(box.targets[-1], FR3.home + 1e-5)


def test_a_far_action_is_approached_at_the_share_of_full_speed_in_its_direction(
    follower: FrankaFollower, box: FakeRobot
):
    start = FR3.home
    far = start + np.array([1.0, 0.5, 0.0, 0.0, -0.25, 0.0, 0.0])
    before = time.monotonic()
    follower.send_action(action(start))
    for _ in range(5):
        time.sleep(0.02)
        follower.send_action(action(far))
    way = box.targets[-1] - start
    passed = time.monotonic() - before
    assert 0 < way[0] <= 0.5 * FR3.velocity[0] * passed + 1e-9
    np.testing.assert_allclose(way[:5] / way[0], [1.0, 0.5, 0.0, 0.0, -0.25], atol=1e-9)


def test_a_joint_stops_a_margin_before_its_limit(follower: FrankaFollower, box: FakeRobot):
    for _ in range(400):
        follower._sent_at -= 0.2  # as if as long had passed
        follower.send_action(action(FR3.upper + 1.0))
    np.testing.assert_allclose(box.targets[-1], FR3.upper - MARGIN)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_an_action_that_is_not_finite_leaves_the_last_standing(
    follower: FrankaFollower, box: FakeRobot, value: float, caplog: pytest.LogCaptureFixture
):
    q = FR3.home + 1e-5
    follower.send_action(action(q))
    for _ in range(3):
        sent = follower.send_action(action(np.where(np.arange(7) == 4, value, q + 0.5), opening=value))
        np.testing.assert_allclose(list(sent.values()), [*np.degrees(q), 1.0])
        np.testing.assert_allclose(box.targets[-1], q)
    assert [record.message for record in caplog.records].count("Invalid action (not finite); the last one stands.") == 1


def test_without_actions_the_arm_brakes_where_it_comes_to_rest(
    follower: FrankaFollower, box: FakeRobot, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    monkeypatch.setattr(FrankaArm, "rest", lambda arm: FR3.home + 0.004)
    monkeypatch.setattr(FrankaArm, "measure", lambda arm: FR3.home + 0.002)
    time.sleep(0.3)
    assert not box.targets  # it watches from the first action on
    follower.send_action(action(FR3.home + 0.02))
    time.sleep(0.4)
    assert len(box.targets) == 2
    np.testing.assert_allclose(box.targets[-1], FR3.home + 0.004)
    assert "No action for 0.2 s" in caplog.text
    follower.send_action(action(FR3.home + 0.02))  # goes on
    assert box.targets[-1][0] > FR3.home[0] + 0.004


def test_braking_never_passes_the_last_target():
    guard = JointGuard(-np.ones(2), np.ones(2), np.ones(2))
    guard.anchor(np.zeros(2))
    guard.target(np.array([0.1, -0.1]), 1.0)
    np.testing.assert_allclose(guard.brake(np.array([0.05, -0.05]), np.array([0.2, -0.07])), [0.1, -0.07])


@pytest.mark.filterwarnings("ignore:divide by zero")
def test_no_time_allows_no_way():
    guard = JointGuard(-np.ones(2), np.ones(2), np.ones(2))
    guard.anchor(np.zeros(2))
    np.testing.assert_allclose(guard.target(np.array([0.1, -0.1]), 0.0), 0.0)


def test_a_reflex_within_an_episode_ends_the_command(follower: FrankaFollower, box: FakeRobot):
    box.abort(ControlException("joint_reflex"))
    with pytest.raises(ReflexError, match=r"joint_reflex.*touched.*Starting again recovers"):
        follower.send_action(action(FR3.home))
    assert not follower.is_connected and "recovered" not in box.asked
    with pytest.raises(DeviceNotConnectedError):
        follower.get_observation()
    follower.disconnect()  # once more


@pytest.mark.parametrize("announcements", [["Recording episode 1"], ["Reset the environment"]])
def test_a_reflex_between_episodes_is_recovered(
    follower: FrankaFollower, box: FakeRobot, announcements: list[str], quiet_logging: None
):
    logging.getLogger().setLevel(logging.INFO)
    logging.info("Recording episode 0")
    follower.get_observation()
    for announcement in announcements:
        logging.info(announcement)
    box.q = FR3.home + 0.3  # somebody pushed it
    box.abort(ControlException("joint_reflex"))
    follower.get_observation()
    assert box.asked["recovered"] and len(box.loops) == 2
    follower.send_action(action(FR3.home + 0.3))
    np.testing.assert_allclose(box.targets[-1], FR3.home + 0.3)  # from where it is


def test_a_lost_connection_ends_the_command_also_between_episodes(
    follower: FrankaFollower, box: FakeRobot, quiet_logging: None
):
    logging.getLogger().setLevel(logging.INFO)
    logging.info("Reset the environment")
    box.abort(FrankaError("network", "UDP receive: Timeout"))
    with pytest.raises(RobotError, match=r"no connection to fake \(UDP receive: Timeout\)"):
        follower.get_observation()
    assert not follower.is_connected


def test_connecting_recovers_passes_the_limits_on_and_homes_the_hand(box: FakeRobot):
    box.mode = "reflex"
    robot = FrankaFollower(FrankaFollowerConfig(address="fake", speed=0.3, collision_torque=50.0, collision_force=60.0))
    robot.connect()
    assert box.asked["recovered"] and box.asked["fraction"] == 0.3 and box.hand.max_width == 0.08
    assert box.asked["thresholds"] == ([50.0] * 7, [50.0] * 7, [60.0] * 6, [60.0] * 6)
    robot.disconnect()
    assert not box.loops[-1].running


@pytest.mark.parametrize(
    ("mode", "version", "said"),
    [("user_stopped", 10, "stop button"), ("other", 10, "activate FCI"), ("idle", 5, "no fr3.*as does panda")],
)
def test_an_arm_that_is_not_ready_says_what_to_do(box: FakeRobot, mode: str, version: int, said: str):
    box.mode, box.fci_version = mode, version
    robot = FrankaFollower(FrankaFollowerConfig(address="fake"))
    with pytest.raises(RobotError, match=said):
        robot.connect()
    assert not robot.is_connected


def test_fingers_that_meet_something_grasp_it(follower: FrankaFollower, box: FakeRobot):
    box.hand.blocked_at = 0.03
    follower.send_action(action(FR3.home, opening=0.0))
    time.sleep(0.1)
    assert box.hand.commands == [("move", 0.0), ("grasp", 20.0)]
    follower.send_action(action(FR3.home, opening=0.01))  # not worth a command
    follower.send_action(action(FR3.home, opening=0.8))
    time.sleep(0.1)
    assert box.hand.commands[2:] == [("move", pytest.approx(0.064))]


def test_the_leader_is_read_and_never_moved(box: FakeRobot):
    leader = FrankaLeader(FrankaLeaderConfig(address="fake", units="rad"))
    leader.connect()
    box.mode, box.q = "guiding", FR3.home + 0.1
    np.testing.assert_allclose(list(leader.get_action().values()), [*(FR3.home + 0.1), 1.0])
    leader.disconnect()
    leader.disconnect()
    assert not box.loops


def test_wrong_options_name_what_is_valid():
    with pytest.raises(UnknownNameError, match="fr3, panda"):
        FrankaFollower(FrankaFollowerConfig(address="fake", arm="xarm7"))
    for options in ({"speed": 0.0}, {"speed": 1.5}, {"timeout": 0.0}):
        with pytest.raises(NumbersError):
            FrankaFollower(FrankaFollowerConfig(address="fake", **options))


def test_an_encoded_action_is_refused(follower: FrankaFollower):
    with pytest.raises(ErIlError, match="er-il attach"):
        follower.send_action({"x": 0.3, "gripper.pos": 1.0})


def test_without_the_library_one_line_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "franka", None)
    with pytest.raises(RobotError, match=r"lerobot_env_er_il\[franka\]"):
        FrankaArm("fake")


def test_a_watchdog_calls_once_a_silence():
    calls: list[float] = []
    watchdog = Watchdog(0.05, lambda: calls.append(time.monotonic()))
    time.sleep(0.1)
    assert not calls
    for silence in (0.15, 0.15):
        for _ in range(5):
            watchdog.feed()
            time.sleep(0.01)
        time.sleep(silence)
    watchdog.end()
    assert len(calls) == 2


def test_the_page_tells_what_was_measured():
    report = json.loads((ROOT / "results" / "franka" / "report.json").read_text())
    page = (ROOT / "docs" / "real_arm.md").read_text()
    for command in ("teleoperate", "record", "rollout"):
        row = next(line for line in page.splitlines() if line.startswith(f"| `lerobot-{command}`"))
        measured = report["chain"][command]
        names = ("period_p50_ms", "period_p99_ms", "work_p50_ms", "work_p99_ms")
        assert re.findall(r"([\d.]+) ms", row) == [f"{measured[name]:.1f}" for name in names]
    tracked = report["chain"]["teleoperate"]
    assert f"lagged {tracked['lag_s']} s" in page and f"{1000 * tracked['largest_error_rad']:.1f} mrad" in page
    assert not any(fault.get("traceback") for fault in report["faults"])
    assert {fault["exit_code"] for fault in report["faults"] if "lost" in fault["fault"]} == {1, "runs on"}


def test_an_error_that_nobody_catches_is_one_line():
    code = (
        "from er_il.support.errors import RobotError; from er_il.support.uncaught import tell_uncaught_in_one_line\n"
        "tell_uncaught_in_one_line(); tell_uncaught_in_one_line()\nraise {}('Lost the arm.')"
    )
    told = subprocess.run([sys.executable, "-c", code.format("RobotError")], capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (1, "error: Lost the arm.\n")
    wrapped = code.format("ValueError").removesuffix("\n") + " from RobotError('No such arm.')"  # as LeRobot does
    told = subprocess.run([sys.executable, "-c", wrapped], capture_output=True, text=True)
    assert (told.returncode, told.stderr) == (1, "error: No such arm.\n")
    bug = subprocess.run([sys.executable, "-c", code.format("KeyError")], capture_output=True, text=True)
    assert bug.returncode == 1 and "Traceback" in bug.stderr
