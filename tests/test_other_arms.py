"""All arms: presets, and files whose frames and joints are found or named. The leading property holds on each."""

import numpy as np
import pytest
from arms import REDUNDANT, SIX_JOINTS

from er_il import Arm, ArmAngleFrames, Status, make_action_space
from er_il.arms.urdf import example_robot_data
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.registry import make_arm_space
from er_il.spaces.round_trip import UNEXPLAINED, round_trips
from er_il.support.errors import ArmError

TIAGO = example_robot_data("tiago_description/robots/tiago.urdf")


@pytest.mark.parametrize("kind", ["erj", "era"])
@pytest.mark.parametrize("name", REDUNDANT)
def test_the_joints_come_back_or_the_reason_is_known(name: str, kind: str) -> None:
    arm = REDUNDANT[name]()
    if kind == "era" and arm.redundancy > 1:
        with pytest.raises(ArmError, match=r"2 redundant joints; one arm angle fixes only one\. Use erj"):
            make_action_space(kind, arm)
        return
    space = make_action_space(kind, arm)
    for count, seed_error, share in ((100, 0.1, 0.95), (30, 0.03, 0.96)):
        trips = round_trips(space.arm_space, count, seed_error=seed_error, rng_seed=5)
        assert np.mean([trip.exact for trip in trips]) >= share
        assert not [trip for trip in trips if trip.cause == UNEXPLAINED]
        assert all(trip.status is Status.OK for trip in trips if trip.exact)
        for trip in trips:
            if trip.status is Status.OK:
                assert max(space.kinematics.pose_error(space.fk(trip.q), trip.found)) < 1e-3


@pytest.mark.parametrize("name", SIX_JOINTS)
def test_six_joints_get_joint_and_task_and_a_refusal_of_the_er_spaces(name: str) -> None:
    arm = SIX_JOINTS[name]()
    assert arm.dof == 6 and arm.redundant == () and arm.angle_frames is None
    for kind in ("erj", "era"):
        with pytest.raises(ArmError, match=f"^{name} has 6 joints and so no redundancy: .* Use joint or task"):
            make_action_space(kind, arm)
    for kind in ("joint", "task"):
        trips = round_trips(make_arm_space(kind, arm), 150)
        assert np.mean([trip.exact for trip in trips]) >= 0.96


def test_frames_and_joints_are_found_in_a_file() -> None:
    iiwa = REDUNDANT["iiwa14"]()
    assert iiwa.ee_frame == "flange" and iiwa.base_frame == "base"
    assert iiwa.joints == tuple(f"joint{i}" for i in range(1, 8)) and iiwa.redundant == ("joint1",)
    assert iiwa.angle_frames == ArmAngleFrames("link2", "link4", "link6")
    with pytest.raises(ArmError, match=r"^tiago\.urdf ends in several links, so name the end-effector frame, such as "):
        Arm.from_urdf(TIAGO)


def test_what_is_found_can_be_asked_for_by_name() -> None:
    with pytest.raises(ArmError, match="torso_lift_joint is prismatic"):
        Arm.from_urdf(TIAGO, ee_frame="arm_tool_link")
    frames = ArmAngleFrames("arm_1_link", "arm_3_link", "arm_5_link")
    arm = Arm.from_urdf(
        TIAGO,
        base_frame="torso_lift_link",
        ee_frame="arm_tool_link",
        joints=[f"arm_{i}_joint" for i in range(1, 8)],
        redundant=["arm_3_joint"],
        angle_frames=frames,
    )
    assert arm.redundant == ("arm_3_joint",) and arm.angle_frames == frames
    assert make_action_space("erj", arm).names[-2] == "arm_3_joint.pos"


@pytest.mark.parametrize(
    ("name", "position"),
    [
        ("gen3", (0.0, -0.0246, 1.1873)),  # the user guide's drawing: the sum of its lengths
        ("iiwa14", (0.0, 0.0, 1.306)),  # 0.36 + 0.42 + 0.40 + 0.126
        ("fr3", (0.088, 0.0, 0.8226)),  # a Panda's
        ("sawyer", (1.0155, 0.1603, 0.317)),  # as its driver reports the pose at zero
    ],
)
def test_the_makers_numbers_put_the_hand_where_it_is_at_zero(name: str, position: tuple[float, ...]) -> None:
    arm = REDUNDANT[name]()
    np.testing.assert_allclose(kinematics_of(arm).fk(np.zeros(7))[:3, 3], position, atol=2e-4)


def test_gen3s_elbow_and_wrist_bend_between_its_links() -> None:
    gen3 = Arm.preset("gen3")
    frames = gen3.angle_frames
    assert frames is not None
    kinematics = kinematics_of(gen3)
    heights = [kinematics.frame_pose(np.zeros(7), link)[2, 3] for link in (frames.shoulder, frames.elbow, frames.wrist)]
    np.testing.assert_allclose(heights, [0.2848, 0.7056, 1.0199], atol=1e-4)
    np.testing.assert_allclose(kinematics.fk(gen3.home)[:3, 2], [1, 0, 0], atol=2e-3)  # at home the hand points ahead
    np.testing.assert_allclose(gen3.upper[[1, 3, 5]], np.radians([128.9, 147.8, 120.3]))
    np.testing.assert_allclose(gen3.upper[[0, 2, 4, 6]], 2 * np.pi)
