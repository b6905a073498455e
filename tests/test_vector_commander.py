"""One arm and its gripper through the commander of a whole vector."""

import numpy as np
import pytest

from er_il import Arm, Status, make_action_space
from er_il.control.vector_commander import VectorCommander

PANDA = Arm.preset("panda")
PERIOD = 0.05
REACH = PANDA.velocity * PERIOD
START = np.append(PANDA.home, 0.4)


def commander(kind: str, on_invalid: str = "best_effort") -> VectorCommander:
    made = VectorCommander(make_action_space(kind, PANDA).layout, PERIOD, on_invalid)
    made.reset(START)
    return made


def test_the_gripper_passes_while_the_arm_follows():
    erj = commander("erj")
    goal = PANDA.home + 0.4 * REACH
    command = erj.command(make_action_space("erj", PANDA).encode(goal, 0.7), START)
    assert command.arms[0].status is Status.OK
    np.testing.assert_allclose(command.vector, np.append(goal, 0.7), atol=1e-3)


@pytest.mark.parametrize("on_invalid", ["best_effort", "hold", "stop"])
def test_an_action_that_means_nothing_moves_neither_arm_nor_gripper(on_invalid: str):
    task = commander("task", on_invalid)
    sagging = START + np.append(np.full(7, 0.01), 0.2)
    for action in (np.full(8, np.nan), np.array([0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0])):  # a zero quaternion
        command = task.command(action, sagging)
        assert command.arms[0].status is Status.INVALID
        np.testing.assert_array_equal(command.vector, START)


def test_a_gripper_that_is_no_number_keeps_the_last_one_that_was():
    joint = commander("joint")
    goal = PANDA.home + 0.4 * REACH
    assert joint.command(np.append(goal, 0.9), START).vector[-1] == 0.9
    command = joint.command(np.append(goal, np.nan), START)
    np.testing.assert_array_equal(command.vector, np.append(goal, 0.9))


def test_a_held_arm_keeps_its_gripper():
    joint = commander("joint", "hold")
    far = PANDA.home + np.array([0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 0.0]) * REACH
    np.testing.assert_array_equal(joint.command(np.append(far, 1.0), START).vector, START)


def test_the_first_command_needs_a_reset():
    with pytest.raises(RuntimeError, match="reset"):
        VectorCommander(make_action_space("joint", PANDA).layout, PERIOD).command(START, START)
