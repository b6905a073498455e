import numpy as np
import pytest

from er_il import Arm, Status
from er_il.control.commander import Commander
from er_il.kinematics.arm_angle import ArmAngle
from er_il.spaces.delta import DeltaBounds
from er_il.spaces.pose import SLACK
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ErIlError, UnknownNameError

PANDA = Arm.preset("panda")
PERIOD = 0.05
REACH = PANDA.velocity * PERIOD


def commander(kind: str = "joint", on_invalid: str = "best_effort") -> Commander:
    made = Commander(make_arm_space(kind, PANDA), PERIOD, on_invalid)
    made.reset(PANDA.home)
    return made


def test_a_valid_action_within_reach_is_followed_exactly():
    erj = commander("erj")
    goal = PANDA.home + 0.4 * REACH
    command = erj.command(erj.space.encode(goal), PANDA.home)
    assert command.status is Status.OK
    np.testing.assert_allclose(command.q, goal, atol=1e-3)


def test_the_velocity_limit_holds_between_successive_commands_and_keeps_the_direction():
    joint = commander()
    goal = PANDA.home + np.array([4.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) * REACH
    first = joint.command(joint.space.encode(goal), PANDA.home)
    np.testing.assert_allclose(first.q - PANDA.home, (goal - PANDA.home) / 4)
    # The measured joints lag behind: the limit counts from the last command all the same.
    second = joint.command(joint.space.encode(goal), PANDA.home)
    np.testing.assert_allclose(second.q - first.q, (goal - PANDA.home) / 4)
    assert first.joint_step == pytest.approx(4 * REACH[0])


@pytest.mark.parametrize("kind", ["joint", "task", "erj", "era"])
@pytest.mark.parametrize("on_invalid", ["best_effort", "hold", "stop"])
def test_whatever_the_policy_says_the_command_is_safe(kind: str, on_invalid: str):
    made = commander(kind, on_invalid)
    rng = np.random.default_rng(0)
    last, q = PANDA.home, PANDA.home
    for step in range(60):
        action = rng.normal(scale=10.0 ** rng.integers(-3, 6), size=made.space.dim)
        if step % 7 == 0:
            action[rng.integers(made.space.dim)] = rng.choice([np.nan, np.inf, -np.inf])
        if step % 11 == 0:
            action[:] = 0.0
        command = made.command(action, q)
        assert np.all(np.isfinite(command.q))
        assert np.all(command.q >= PANDA.lower) and np.all(command.q <= PANDA.upper)
        assert np.all(np.abs(command.q - last) <= REACH + 1e-9)
        last, q = command.q, command.q
    assert made.tally.statuses.total() == len(made.tally.latencies) == 60
    assert made.tally.invalid > 0


def test_an_action_that_means_nothing_leaves_the_last_command():
    task = commander("task")
    sagging = PANDA.home + 0.01
    for action in (np.full(7, np.nan), np.array([0.5, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0])):  # a zero quaternion
        command = task.command(action, sagging)
        assert command.status is Status.INVALID
        np.testing.assert_array_equal(command.q, PANDA.home)


def test_lost_measurements_hold_the_arm():
    joint = commander()
    command = joint.command(joint.space.encode(PANDA.home + 0.01), np.full(7, np.nan))
    assert command.status is Status.INVALID
    np.testing.assert_array_equal(command.q, PANDA.home)


def far_away() -> np.ndarray:
    return PANDA.home + np.array([0.0, 0.0, 6.0, 0.0, 0.0, 0.0, 0.0]) * REACH


def test_a_solution_on_another_branch_is_a_jump():
    joint = commander()
    assert joint.command(joint.space.encode(far_away()), PANDA.home).status is Status.JUMP
    near = PANDA.home + 4.9 * REACH
    assert joint.command(joint.space.encode(near), PANDA.home).status is Status.OK


# The upper arm stands upright, where joints 1 and 3 turn it alike: the arm angle hardly says which of them turns.
UPRIGHT = np.array([0.1, -0.01, -0.1, -1.96, 0.07, 3.17, 0.72])


@pytest.mark.parametrize("delta", ["", "delta_"])
@pytest.mark.parametrize(
    ("kind", "error", "arrives"), [("era", 0.05, False), ("era", -0.05, False), ("erj", 0.8, True), ("erj", -0.8, True)]
)
def test_towards_an_elbow_far_away_the_pose_is_kept(kind: str, error: float, arrives: bool, delta: str):
    q = UPRIGHT
    made = Commander(make_arm_space(delta + kind, PANDA, bounds=DeltaBounds(angle=0.8)), PERIOD)
    made.reset(q)
    action = made.space.encode(q)  # a delta's is zero
    action[-1] += error
    pose, start = made.space.fk(q), q
    statuses = []
    for _ in range(1 if delta else 30):
        command = made.command(action, q)
        statuses.append(command.status)
        q = command.q
        np.testing.assert_allclose(made.space.fk(q)[:3, 3], pose[:3, 3], atol=2e-3)
    assert statuses[0] is Status.JUMP
    assert np.all(np.abs(q - start) <= REACH * len(statuses) + 1e-9)
    if delta:  # counts from the last command: one decode is all that it says
        return
    # A small change of the arm angle turns joint 1 by far more: of its last centimetre on the circle nothing is made.
    missed = 0.0 if arrives else SLACK / ArmAngle(PANDA).circle(q).radius
    assert made.space.encode(q)[7] == pytest.approx(action[7], abs=missed + 1e-6)
    assert (statuses[-1] is Status.OK) == (q[0] - start[0] == pytest.approx(error, abs=1e-3)) == arrives


@pytest.mark.parametrize("kind", ["era", "era@stereo"])
def test_next_to_a_singularity_errors_of_the_arm_angle_move_the_hand_alone(kind: str):
    """A path through the upright upper arm, with errors of the arm angle like a policy's: the joints keep to it."""
    made, rng = Commander(make_arm_space(kind, PANDA), PERIOD), np.random.default_rng(0)
    path = UPRIGHT + np.linspace(-0.3, 0.3, 60)[:, None] * np.array([0, 1, 0, 0.5, 0, 0.5, 0])
    made.reset(path[0])
    actions, alone, q = made.space.encode(path), path[0], path[0]
    strayed = {"commanded": 0.0, "decoded": 0.0}
    for action, meant in zip(actions, path, strict=True):
        action[-1] += rng.normal(scale=0.01)
        q, alone = made.command(action, q).q, made.space.decode(action, alone).q
        assert np.linalg.norm(made.space.fk(q)[:3, 3] - action[:3]) < 2e-3
        strayed["commanded"] = max(strayed["commanded"], np.abs(q - meant).max())
        strayed["decoded"] = max(strayed["decoded"], np.abs(alone - meant).max())
    assert strayed["commanded"] < 0.25 < 0.5 < strayed["decoded"]


def test_best_effort_approaches_hold_waits_and_stop_stays():
    best, hold, stop = commander(), commander(on_invalid="hold"), commander(on_invalid="stop")
    jump, fine = best.space.encode(far_away()), best.space.encode(PANDA.home + 0.5 * REACH)
    assert best.command(jump, PANDA.home).q[2] == pytest.approx(PANDA.home[2] + REACH[2])
    np.testing.assert_array_equal(hold.command(jump, PANDA.home).q, PANDA.home)
    np.testing.assert_allclose(hold.command(fine, PANDA.home).q, PANDA.home + 0.5 * REACH)
    assert stop.command(fine, PANDA.home).stopped is False
    for action in (jump, fine):
        command = stop.command(action, PANDA.home)
        assert command.stopped
        np.testing.assert_allclose(command.q, PANDA.home + 0.5 * REACH)
    stop.reset(PANDA.home)
    assert not stop.command(fine, PANDA.home).stopped
    assert stop.tally.invalid == 0


def test_an_unreachable_target_is_counted_and_answered_in_bounded_steps():
    task = commander("task")
    q = PANDA.home
    away = task.space.encode(PANDA.home)
    away[:3] = [3.0, 0.0, 0.5]
    for _ in range(40):
        command = task.command(away, q)
        assert np.all(np.abs(command.q - q) <= REACH + 1e-9)
        q = command.q
    assert task.tally.invalid == 40


def test_mistakes_name_the_choices():
    space = make_arm_space("joint", PANDA)
    with pytest.raises(UnknownNameError, match="best_effort, hold, stop"):
        Commander(space, PERIOD, "panic")
    with pytest.raises(ErIlError, match="positive"):
        Commander(space, 0.0)
    with pytest.raises(ErIlError, match="not finite"):
        Commander(space, PERIOD).reset(np.full(7, np.nan))


def test_a_delta_counts_from_the_last_command_not_from_where_the_arm_sags_to():
    delta = commander("delta_joint")
    change = 0.1 * REACH
    for step in (1, 2):
        command = delta.command(change, PANDA.home - 0.01)
        np.testing.assert_allclose(command.q, PANDA.home + step * change, atol=1e-9)


def test_an_arm_that_is_held_up_is_waited_for_and_can_turn_back():
    joint = commander()
    held = PANDA.home + 0.1 * REACH
    goal = joint.space.encode(PANDA.home + 5 * REACH)
    commands = [joint.command(goal, held) for _ in range(8)]
    assert [command.followed for command in commands] == [True] * 4 + [False] * 4
    np.testing.assert_allclose(commands[-1].q, PANDA.home + 4 * REACH)
    assert not joint.strayed(held)
    back = joint.command(joint.space.encode(PANDA.home), held)
    np.testing.assert_allclose(back.q, PANDA.home + 3 * REACH)
    assert joint.strayed(PANDA.home - 3 * REACH)
