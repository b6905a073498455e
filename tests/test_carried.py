"""Carried deltas: a change of the commanded joint turns the hand's target along."""

import json

import numpy as np
import pytest

from er_il import Arm, Status, from_spec, make_action_space
from er_il.support.errors import ArmError, UnknownNameError

PANDA = Arm.preset("panda")


def demo(steps: int = 120) -> np.ndarray:
    """A smooth path through the workspace, at a fraction of full speed."""
    time = np.linspace(0, 2 * np.pi, steps)[:, None]
    return PANDA.home + 0.25 * np.sin(time * np.array([1, 1, 2, 1, 2, 1, 2]) + np.arange(7)) * np.ones(7)


def test_turning_the_base_joint_yaws_the_whole_arm():
    carried, free = (make_action_space(f"{kind}_erj", PANDA) for kind in ("carried", "delta"))
    action = np.zeros(8)
    action[6] = 0.07
    turned = carried.decode(action, PANDA.home).q
    np.testing.assert_allclose(turned, PANDA.home + 0.07 * np.eye(7)[0], atol=1e-6)
    before, after = carried.fk(PANDA.home), carried.fk(turned)
    assert np.linalg.norm(after[:3, 3] - before[:3, 3]) > 0.02
    # By the paper's text the hand stays where it was.
    np.testing.assert_allclose(free.fk(free.decode(action, PANDA.home).q), before, atol=1e-5)


def test_the_change_of_the_pose_is_added_to_the_carried_target():
    space = make_action_space("carried_erj", PANDA)
    action = np.array([0.02, -0.01, 0.03, 0.0, 0.0, 0.1, -0.05, 1.0])
    carried = space.fk(PANDA.home - 0.05 * np.eye(7)[0])
    decoded = space.decode(action, PANDA.home)
    after = space.fk(decoded.q)
    assert decoded.status is Status.OK and decoded.q[0] == pytest.approx(PANDA.home[0] - 0.05)
    np.testing.assert_allclose(after[:3, 3], carried[:3, 3] + action[:3], atol=1e-5)
    c, s = np.cos(0.1), np.sin(0.1)
    np.testing.assert_allclose(after[:3, :3] @ carried[:3, :3].T, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-5)


@pytest.mark.parametrize("joint", ["panda_joint1", "panda_joint3", "panda_joint7"])
def test_encoding_inverts_decoding_along_a_demonstration(joint: str):
    q, space = demo(), make_action_space(f"carried_erj@{joint}", PANDA)
    path = [q[0]]
    for action in space.encode(q[1:], start=q[0]):
        decoded = space.decode(action, path[-1], current=path[-1])
        path.append(decoded.q)
    assert np.abs(np.array(path) - q).max() < 1e-4


def test_its_spec_tells_it_from_the_papers_text():
    space = make_action_space("carried_erj", PANDA)
    again = from_spec(json.loads(json.dumps(space.spec())))
    assert again.spec() == space.spec() and space.spec()["space"] == "carried_erj"
    assert type(again.arm_space) is type(space.arm_space)


def test_only_joints_carry():
    for kind in ("carried_era", "carried_task", "carried_joint"):
        with pytest.raises(UnknownNameError, match="carried_erj"):
            make_action_space(kind, PANDA)
    with pytest.raises(ArmError, match="no redundancy"):
        make_action_space("carried_erj", Arm.from_urdf(PANDA.urdf, ee_frame="panda_link6", joints=PANDA.joints[:6]))
