"""OpenArm's presets against its maker's models, and datasets as LeRobot's driver for two OpenArms records them."""

import sys
from pathlib import Path

import numpy as np
import pytest
from foreign import write_dataset
from lerobot.robots.openarm_follower import OpenArmFollowerConfigBase
from lerobot.robots.openarm_follower.config_openarm_follower import (
    LEFT_DEFAULT_JOINTS_LIMITS,
    RIGHT_DEFAULT_JOINTS_LIMITS,
)
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.arms.openarm import SIDES, VERSIONS, mirrored
from er_il.arms.robot import robot_arms, robot_name
from er_il.cli import main
from er_il.cli.arm_options import ArmOptions
from er_il.datasets.dataset import Dataset
from er_il.datasets.wiring import read_wirings
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import DatasetError, UnknownNameError

PRESETS = [f"openarm_{version}_{side}" for version in VERSIONS for side in SIDES]
WRIST_TO_TIP = np.array([0.0, 0.0, -0.1635])  # [m] of version 2, whose reference is the wrist
TURNED = Rotation.from_euler("x", np.pi)  # of our hand against it
MIRROR = np.diag([1.0, -1.0, 1.0])


@pytest.mark.parametrize("name", PRESETS)
def test_forward_kinematics_and_limits_are_those_of_the_makers_model(name: str) -> None:
    with np.load(Path(__file__).parent / "openarm" / "reference.npz") as file:
        limits, q, pose = (file[f"{name}.{part}"].astype(np.float64) for part in ("limits", "q", "pose"))
    arm = Arm.preset(name)
    assert len(q) == 1000
    np.testing.assert_allclose(np.column_stack([arm.lower, arm.upper]), limits, atol=1e-4)
    rotation, position = Rotation.from_quat(pose[:, 3:], scalar_first=True), pose[:, :3]
    if "_v2_" in name:
        rotation, position = rotation * TURNED, position + rotation.apply(WRIST_TO_TIP)
    T_base_ee = kinematics_of(arm).fk_batch(q)
    assert np.linalg.norm(T_base_ee[:, :3, 3] - position, axis=1).max() < 1e-4
    assert (Rotation.from_matrix(T_base_ee[:, :3, :3]).inv() * rotation).magnitude().max() < 1e-4


@pytest.mark.parametrize("version", VERSIONS)
def test_mirrored_postures_mirror_hands_and_elbows(version: str) -> None:
    left, right = robot_arms(f"openarm_{version}").values()
    for q in np.random.default_rng(0).uniform(left.lower, left.upper, (20, 7)):
        other = np.array(mirrored(q.tolist()))
        assert np.all((right.lower <= other) & (other <= right.upper))
        for link in ("link4", "link7"):  # elbow and wrist; version 1's hands are not mirrored
            one = kinematics_of(left).frame_pose(q, f"openarm_left_{link}")[:3, 3]
            two = kinematics_of(right).frame_pose(other, f"openarm_right_{link}")[:3, 3]
            np.testing.assert_allclose(two, MIRROR @ one, atol=1e-12)
        angles = [float(ArmAngle(arm).wrapped(np.array([at]))[0]) for arm, at in ((left, q), (right, other))]
        assert np.cos(angles[0] + angles[1]) == pytest.approx(1.0)


def test_a_robot_is_known_by_its_arms() -> None:
    arms = robot_arms("openarm_v2")
    assert list(arms) == ["left", "right"]
    assert robot_name({label: arm.name for label, arm in arms.items()}) == "openarm_v2"
    assert robot_name({"left": "panda", "right": "xarm7"}) == "panda+xarm7"
    assert list(robot_arms("panda")) == [""]
    with pytest.raises(UnknownNameError, match=r"openarm_v2, .*panda8"):
        robot_arms("openarm")


def driver_names() -> list[str]:
    """Names of the actions of LeRobot's own driver, which needs its extra for CAN to be made."""
    motors = OpenArmFollowerConfigBase(port="none").motor_config
    return [f"{side}_{motor}.pos" for side in SIDES for motor in motors]


@pytest.mark.parametrize("version", VERSIONS)
def test_a_dataset_of_lerobots_driver_is_encoded_by_the_shipped_wiring(
    version: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, steps, arms = np.random.default_rng(0), 30, robot_arms(f"openarm_{version}")
    paths = {side: arm.home + rng.uniform(-0.1, 0.1, (steps, 7)) for side, arm in arms.items()}
    values = {f"{side}_gripper.pos": np.linspace(-65.0, 0.0, steps) for side in SIDES}
    for side, path in paths.items():
        values |= {f"{side}_joint_{i}.pos": joint for i, joint in enumerate(np.rad2deg(path).T, start=1)}
    write_dataset(tmp_path / "fold", [values], driver_names(), camera=False)
    out = tmp_path / "fold_erj"
    command = ["encode", str(tmp_path / "fold"), "--to", "erj", "--arms", f"openarm_{version}", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["er-il", *command])
    main()
    dataset = Dataset(out)
    assert [part.space.arm.name for part in dataset.layout.parts] == [f"openarm_{version}_{side}" for side in SIDES]
    encoded, grippers = dataset.layout.split_encoded(dataset.vectors("action").astype(np.float64))
    np.testing.assert_allclose(grippers[:, 0], values["left_gripper.pos"], atol=1e-4)
    for action, (side, path) in zip(encoded, paths.items(), strict=True):
        hand = kinematics_of(arms[side]).fk_batch(path)[:, :3, 3]
        np.testing.assert_allclose(action[:, :3], hand, atol=1e-5)
        np.testing.assert_allclose(action[:, -1], path[:, 2], atol=1e-5)  # the upper arm's twist


@pytest.mark.parametrize(
    ("side", "limits"), [("left", LEFT_DEFAULT_JOINTS_LIMITS), ("right", RIGHT_DEFAULT_JOINTS_LIMITS)]
)
def test_the_drivers_limits_lie_within_the_presets(side: str, limits: dict[str, tuple[float, float]]) -> None:
    """Which they would not, were a sign or a zero of joints 2 and 4 another; the other ranges are symmetric."""
    driver, arm = np.radians([limits[f"joint_{i}"] for i in range(1, 8)]), Arm.preset(f"openarm_v2_{side}")
    assert np.all(driver[:, 0] >= arm.lower)
    assert np.all(driver[:, 1] <= arm.upper)


def test_a_file_of_arms_that_is_neither_there_nor_shipped() -> None:
    with pytest.raises(DatasetError, match=r"no file of arms openarm_v3\. Shipped: openarm_v1, openarm_v2\.$"):
        read_wirings(Path("openarm_v3"))


def test_a_robot_of_two_arms_is_no_arm() -> None:
    with pytest.raises(DatasetError, match=r"^openarm_v2 has several arms: give --arms openarm_v2\.$"):
        ArmOptions(arm="openarm_v2").wirings()
