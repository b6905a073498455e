"""Which joint ERJ should command, on arms whose geometry tells the answer."""

from pathlib import Path

import numpy as np
import pytest
from chains import chain_arm

from er_il import Arm
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.joint_choice import (
    FLIP,
    Choice,
    Sensitivity,
    SingularInterval,
    along_demos,
    choices,
    crossings,
    over_workspace,
    play_back,
    ranked,
    sensitivity,
    singular_intervals,
)
from er_il.spaces.registry import make_arm_space
from er_il.spaces.round_trip import SINGULAR
from er_il.support.errors import ArmError

PANDA = Arm.preset("panda")
ODD, EVEN = ([(f"panda_joint{i}",) for i in numbers] for numbers in ((1, 3, 5, 7), (2, 4, 6)))
BEND = f'rpy="{np.pi / 2} 0 0"'
BACK = f'rpy="{-np.pi / 2} 0 0"'


def configurations(arm: Arm, count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(arm.lower, arm.upper, (count, arm.dof))


def sensitivities(arm: Arm, q: np.ndarray) -> dict[Choice, Sensitivity]:
    return {choice: sensitivity(JointAngle(arm, choice), q) for choice in choices(arm)}


def elbow_turn(degrees: np.ndarray) -> np.ndarray:
    """The Panda's hand stays at home while its elbow goes through arm angles."""
    kinematics, path = kinematics_of(PANDA), [PANDA.home]
    for angle in np.radians(degrees):
        path.append(kinematics.solve(kinematics.fk(PANDA.home), path[-1], ArmAngle(PANDA), [angle]).q)
    return np.array(path[1:])


@pytest.fixture(scope="module")
def human_like(tmp_path_factory) -> Arm:
    """A spherical shoulder, a hinge for an elbow and a spherical wrist, without any offset."""
    turns = ["", BEND, BACK, BEND, BACK, BEND, BACK]
    lengths = [0.3, 0.0, 0.4, 0.0, 0.4, 0.0, 0.0]
    joints = "".join(
        f'<joint name="j{i + 1}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{_along(turn, length)}" {turn}/><axis xyz="0 0 1"/>'
        '<limit lower="-2.5" upper="2.5" effort="1" velocity="2"/></joint>'
        for i, (turn, length) in enumerate(zip(turns, lengths, strict=True))
    )
    tool = '<link name="tool"/><joint name="t" type="fixed"><parent link="l7"/><child link="tool"/>'
    tool += '<origin xyz="0 0 0.1"/></joint>'
    links = "".join(f'<link name="l{i}"/>' for i in range(8))
    path = Path(tmp_path_factory.mktemp("arm")) / "human.urdf"
    path.write_text(f'<robot name="human">{links}{joints}{tool}</robot>')
    return Arm.from_urdf(path, ee_frame="tool")


def _along(turn: str, length: float) -> str:
    """Links go along the axis of the twisting joint before them, whose frame a bend has turned."""
    return f"0 {-length if turn == BACK else 0} {length if turn != BACK else 0}"


def test_the_elbow_of_a_human_like_arm_is_never_in_its_self_motion(human_like):
    """It alone sets how far the wrist is from the shoulder: held, the others have nothing left for that distance."""
    q = configurations(human_like, 200)
    found = sensitivities(human_like, q)
    assert np.abs(found[("j4",)].self_motion).max() < 1e-6
    assert found[("j4",)].smallest.max() < 1e-6
    others = [np.median(np.abs(found[(f"j{i}",)].self_motion)) for i in (1, 2, 3, 5, 6, 7)]
    assert min(others) > 0.05
    assert kinematics_of(human_like).twisting.tolist() == [True, False, True, False, True, False, True]
    (interval,) = singular_intervals(found[("j4",)].smallest)
    assert interval == SingularInterval(0, 199, pytest.approx(0.0, abs=1e-6))


@pytest.mark.parametrize("joints", [7, 8])
def test_what_is_left_to_ik_shrinks_with_the_share_of_self_motion(tmp_path, joints):
    arm = chain_arm(tmp_path, joints)
    q = configurations(arm, 20)
    jacobians = np.array([kinematics_of(arm).jacobian(each) for each in q])
    whole = np.sqrt(np.linalg.det(jacobians @ jacobians.transpose(0, 2, 1)))
    found = sensitivities(arm, q)
    assert len(found) == {7: 7, 8: 28}[joints]
    for choice, each in found.items():
        left = np.delete(jacobians, [arm.joints.index(joint) for joint in choice], axis=2)
        np.testing.assert_allclose(np.linalg.det(left), each.self_motion * whole, atol=1e-9)
        np.testing.assert_allclose(
            each.smallest,
            [kinematics_of(arm).conditioning(row, JointAngle(arm, choice)) for row in q],
            atol=1e-9,
        )


def test_the_pandas_redundancy_lies_among_its_twisting_joints():
    twisting = kinematics_of(PANDA).twisting
    assert [(joint,) for joint, twists in zip(PANDA.joints, twisting, strict=True) if twists] == ODD
    q = configurations(PANDA, 1000)
    found = sensitivities(PANDA, q)
    share = {choice: np.abs(each.self_motion).mean() for choice, each in found.items()}
    near = {choice: (each.smallest < SINGULAR).mean() for choice, each in found.items()}
    assert min(share[choice] for choice in ODD) > max(share[choice] for choice in EVEN)
    assert max(near[choice] for choice in ODD) < min(near[choice] for choice in EVEN)
    assert max(share, key=lambda choice: -share[choice]) == ("panda_joint4",)


def test_a_demo_past_the_highest_elbow_crosses_the_folds_of_bending_joints_only():
    """There the arm is symmetric, and self-motion turns the bending joints neither way."""
    demo = elbow_turn(np.linspace(-40, 40, 60))
    found = sensitivities(PANDA, demo)
    for choice in EVEN:
        assert crossings(found[choice].self_motion) % 2 == 1
    for choice in ODD[:3]:
        assert crossings(found[choice].self_motion) == 0
    fitness = {choice: along_demos(PANDA, choice, [demo]) for choice in (ODD[0], ODD[1], EVEN[0], EVEN[1])}
    assert ranked([list(fitness.values())])[:2] in ([ODD[0], ODD[1]], [ODD[1], ODD[0]])
    assert fitness[ODD[0]].off == fitness[ODD[0]].folds == 0
    assert fitness[EVEN[1]].risk > 0.5 > fitness[ODD[0]].risk
    assert fitness[EVEN[0]].flips > 0


def test_playback_follows_a_demo_and_is_the_same_each_time():
    demo = elbow_turn(np.linspace(-40, 40, 40))
    good, bad = (make_arm_space(f"erj@panda_joint{i}", PANDA) for i in (1, 4))
    distances = play_back(good, demo, np.random.default_rng(0))
    assert 1e-3 < distances.max() < FLIP
    assert play_back(bad, demo, np.random.default_rng(0)).max() > FLIP
    np.testing.assert_array_equal(distances, play_back(good, demo, np.random.default_rng(0)))


def test_the_workspace_tells_a_good_choice_from_a_bad_one():
    q = configurations(PANDA, 300)
    one, four = (over_workspace(PANDA, (f"panda_joint{i}",), q) for i in (1, 4))
    assert one.missed < 0.06
    assert one.condition_p50 < four.condition_p50 / 3
    assert four.risk == four.near_singular > one.risk
    assert one.flips is None


def test_an_arm_without_redundancy_has_nothing_to_command(tmp_path):
    with pytest.raises(ArmError, match=r"^chain6 has 6 joints and so no redundancy: .* Use joint or task\.$"):
        choices(chain_arm(tmp_path, 6))
    assert len(choices(chain_arm(tmp_path, 9))) == 84
