"""Reach Elbow Pose: goals that hand and elbow can meet at once, each judged by itself."""

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError
from sim_tasks.tasks.reach_elbow_pose import ELBOW, ELBOW_GOAL, HAND_GOAL, ReachElbowPose


def make(**kwargs: object) -> ReachElbowPose:
    world = gymnasium.make("sim_tasks/ReachElbowPose-v0", **kwargs).unwrapped
    assert isinstance(world, ReachElbowPose)
    return world


def hold(world: ReachElbowPose, q: np.ndarray) -> dict:
    """The info once the arm has come to rest at q (n,) [rad]."""
    info: dict = {}
    for _ in range(60):
        info = world.step(np.append(q, 1.0))[4]
    return info


@pytest.mark.parametrize("arm", ["panda", "panda8"])
def test_goals_can_be_met_at_once_within_the_limits_with_the_elbow_at_either_side(arm: str) -> None:
    world = make(arm=arm)
    kinematics = kinematics_of(world.arm)
    sides = []
    for seed in range(30):
        world.reset(seed=seed)
        q = world.posture
        assert np.all((q > world.arm.lower) & (q < world.arm.upper))
        T_base_hand = kinematics.fk(q)
        assert T_base_hand[:3, 3] == pytest.approx(world.position(HAND_GOAL), abs=1e-3)
        turn = Rotation.from_matrix(world.rotation(HAND_GOAL).T @ T_base_hand[:3, :3])
        assert turn.magnitude() < 0.005
        elbow = kinematics.frame_pose(q, ELBOW)[:3, 3]
        assert elbow == pytest.approx(world.position(ELBOW_GOAL), abs=1e-6)
        hand = world.position(HAND_GOAL)
        sides.append(np.sign(elbow[1] - elbow[0] * hand[1] / hand[0]))
    assert 8 <= np.sum(np.array(sides) > 0) <= 22
    world.reset(seed=0)
    assert hold(world, world.posture)["is_success"]


def test_the_hand_alone_is_no_success() -> None:
    world = make()
    _, info = world.reset(seed=0, options={"beyond_success": True})
    assert max(info["reward_terms"].values()) < 0.7 * 0.25
    T_base_hand = kinematics_of(world.arm).fk(world.posture)
    ik = kinematics_of(world.arm).solve(
        T_base_hand, world.joint_positions, JointAngle(world.arm, world.arm.redundant), [0.0]
    )
    assert ik.status is Status.OK
    terms = hold(world, ik.q)["reward_terms"]
    assert terms["hand"] == terms["turn"] == 0.25
    assert 0.03 < terms["elbow"] < 0.7 * 0.25 and terms["success"] == 0.0


def test_the_turn_is_judged_by_itself() -> None:
    world = make()
    world.reset(seed=0)
    turned = world.posture.copy()
    turned[-1] += 0.4  # about the hand's own axis: 0.13 rad in the mean of the three
    terms = hold(world, turned)["reward_terms"]
    assert terms["hand"] == terms["elbow"] == 0.25
    assert 0.4 * 0.25 < terms["turn"] < 0.25 and terms["success"] == 0.0
    turned[-1] -= 0.2
    assert hold(world, turned)["is_success"]


def test_goals_apart_have_no_plan() -> None:
    world = make()
    world.reset(seed=0, options={"state": {ELBOW_GOAL: (0.6, 0.4, 0.0)}})
    with pytest.raises(PlanError, match="hand and elbow"):
        world.leader(0)
