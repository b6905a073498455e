import logging

import numpy as np
import pytest

from er_il import Arm
from er_il.robots.robot_commander import RobotCommander
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError, ShapeError, UnknownNameError

PANDA, XARM = Arm.preset("panda"), Arm.preset("xarm7")
PERIOD = 0.05

# A bimanual robot in degrees, its joints shuffled, one arm's motors turning the other way.
LEFT = Motors(tuple(f"left_{i}.pos" for i in range(1, 8)), "deg", signs=(1, -1) * 3 + (1,), offsets=(10.0,) * 7)
RIGHT = Motors(tuple(f"right_{i}.pos" for i in range(1, 8)), "deg")
NAMES = ("lift.pos", *RIGHT.joints[::-1], "right_gripper.pos", *LEFT.joints[3:], *LEFT.joints[:3])


def layout(kind: str) -> Layout:
    arms = (("left", PANDA, LEFT), ("right", XARM, RIGHT))
    return Layout(NAMES, tuple(Part(label, make_arm_space(kind, arm), motors) for label, arm, motors in arms))


def vector(left: np.ndarray, right: np.ndarray, lift: float = 3.0, gripper: float = 40.0) -> np.ndarray:
    named = dict(zip(LEFT.joints, LEFT.values(left), strict=True))
    named |= dict(zip(RIGHT.joints, RIGHT.values(right), strict=True))
    named |= {"lift.pos": lift, "right_gripper.pos": gripper}
    return np.array([named[name] for name in NAMES])


START = vector(PANDA.home, XARM.home, np.nan, 20.0)  # the lift is not measured
NEAR = vector(PANDA.home + 0.4 * PERIOD * PANDA.velocity, XARM.home - 0.4 * PERIOD * XARM.velocity)


@pytest.mark.parametrize("kind", ["joint", "erj", "era"])
def test_two_arms_are_told_what_was_encoded_in_the_robots_own_order_and_units(kind: str):
    commander = RobotCommander(layout(kind), PERIOD)
    (action,) = commander.layout.encode(NEAR[None])
    command = commander.command(action, START)
    np.testing.assert_allclose(command.vector, NEAR, atol=0.06)  # degrees, 1e-3 rad
    assert [arm.status.value for arm in command.arms] == ["ok", "ok"]


def test_velocity_limits_hold_for_each_arm():
    commander = RobotCommander(layout("erj"), PERIOD)
    far = vector(PANDA.home + 4 * PERIOD * PANDA.velocity, XARM.home)
    (action,) = commander.layout.encode(far[None])
    told = commander.command(action, START).vector
    left = LEFT.angles([told[NAMES.index(name)] for name in LEFT.joints]) - PANDA.home
    assert np.all(np.abs(left) <= PERIOD * PANDA.velocity + 1e-9)
    assert np.max(np.abs(left) / (PERIOD * PANDA.velocity)) == pytest.approx(1.0)


def test_an_action_that_means_nothing_moves_nothing_and_is_logged_once(caplog: pytest.LogCaptureFixture):
    commander = RobotCommander(layout("erj"), PERIOD)
    (action,) = commander.layout.encode(NEAR[None])
    commander.command(action, START)
    broken = action.copy()
    broken[4] = np.nan  # the left arm's rotation
    broken[-1] = 99.0  # a gripper that would open meanwhile
    with caplog.at_level(logging.INFO):
        for _ in range(3):
            command = commander.command(broken, NEAR)
        np.testing.assert_allclose(command.vector, NEAR, atol=0.06)
        commander.reset()
    assert [record.message for record in caplog.records] == [
        "Invalid action (left invalid); the answer is best_effort.",
        "Actions decoded: 3 left invalid; 1 valid",
    ]


def test_when_one_arm_stops_all_do_until_the_next_episode():
    commander = RobotCommander(layout("erj"), PERIOD, "stop")
    (action,) = commander.layout.encode(NEAR[None])
    broken = action.copy()
    broken[0] = np.inf
    commander.command(action, START)
    stopped = commander.command(broken, NEAR).vector
    (back,) = commander.layout.encode(vector(PANDA.home, XARM.home)[None])
    np.testing.assert_array_equal(commander.command(back, NEAR).vector, stopped)
    commander.reset()
    assert not any(arm.stopped for arm in commander.command(back, NEAR).arms)


def test_an_arm_that_was_moved_by_hand_goes_on_from_where_it_is(caplog: pytest.LogCaptureFixture):
    """LeRobot's record command never resets its processors."""
    commander = RobotCommander(layout("joint"), PERIOD)
    commander.command(NEAR, START)
    moved = vector(PANDA.home + 0.8, XARM.home)
    goal = vector(PANDA.home + 0.8 + 0.5 * PERIOD * PANDA.velocity, XARM.home)
    command = commander.command(goal, moved)
    np.testing.assert_allclose(command.vector, goal, atol=1e-6)
    assert "moved by something else" in caplog.text


def test_mistakes():
    with pytest.raises(UnknownNameError, match="best_effort, hold, stop"):
        RobotCommander(layout("erj"), PERIOD, "panic")
    commander = RobotCommander(layout("erj"), PERIOD)
    with pytest.raises(ShapeError, match=r"left_ee\.x"):
        commander.command(np.zeros(3), START)
    with pytest.raises(ShapeError, match="Measured"):
        commander.command(np.zeros(18), np.zeros(3))
    (action,) = commander.layout.encode(NEAR[None])
    with pytest.raises(ErIlError, match="not finite"):
        commander.command(action, np.full(len(NAMES), np.nan))
    action[-2] = np.nan
    with pytest.raises(ErIlError, match=r"Nothing is known of lift\.pos"):
        commander.command(action, START)
