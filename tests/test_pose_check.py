"""Recorded end-effector poses: convention, frames and residual are found, and so is what is wrong with the joints."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from documented import run
from foreign import paths
from lerobot.datasets import LeRobotDataset
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.cli import main
from er_il.datasets.pose_check import JointValues, PoseCheck, check_poses
from er_il.datasets.pose_columns import PoseColumn
from er_il.kinematics.frame_fit import fit_frames, inverse
from er_il.kinematics.pose_codes import CODES
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.motors import Motors

PANDA = Arm.preset("panda")
MOTORS = Motors(tuple(f"m{i}" for i in range(1, 8)))
Q = np.concatenate(paths(PANDA, 0))
T_BASE_EE = kinematics_of(PANDA).fk_batch(Q)
FLANGE = kinematics_of(PANDA).rigid_to("panda_hand_tcp")["panda_link8"]


def transform(turn, position) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), position
    return T


def written(T: np.ndarray, code: str) -> np.ndarray:
    """Poses (N, 4, 4) as their code says, by SciPy and NumPy alone."""
    R, p = Rotation.from_matrix(T[:, :3, :3]), T[:, :3, 3]
    matrix = T[:, :3, :3]
    euler = {"roll, pitch, yaw": "xyz", "Euler": "XYZ", "yaw, pitch, roll": "ZYX"}
    for start, order in euler.items():
        if code.startswith(start):
            return np.column_stack([p, R.as_euler(order, degrees=code.endswith("degrees"))])
    rotations = {
        "rotation vector": R.as_rotvec(),
        "quaternion x, y, z, w": R.as_quat(),
        "quaternion w, x, y, z": R.as_quat(scalar_first=True),
        "rot6d by columns": np.column_stack([matrix[:, :, 0], matrix[:, :, 1]]),
        "rot6d by rows": np.column_stack([matrix[:, 0], matrix[:, 1]]),
        "rotation matrix by rows": matrix.reshape(-1, 9),
        "rotation matrix by columns": matrix.transpose(0, 2, 1).reshape(-1, 9),
    }
    if code in rotations:
        return np.column_stack([p, rotations[code]])
    return (T if code.endswith("rows") else T.transpose(0, 2, 1)).reshape(-1, 16)


def checked(values: np.ndarray, arm: Arm = PANDA, motors: Motors = MOTORS, joints: np.ndarray = Q) -> PoseCheck | None:
    place = PoseColumn("observation.eef", tuple(map(str, range(values.shape[1]))), values.astype(np.float32), told=True)
    return check_poses([place], [JointValues(arm, motors, joints, measured=True)])


@pytest.mark.parametrize("code", [code.name for code in CODES])
def test_every_convention_is_recognised_though_more_follows(code: str):
    values = np.column_stack([written(T_BASE_EE @ FLANGE, code), np.linspace(0, 1, len(Q))])  # a gripper
    found = checked(values)
    assert found is not None and found.agrees
    said = found.report()
    assert said["convention"] == code
    assert (said["ee_frame"], said["base_frame"]) == ("panda_link8", "panda_link0")
    assert said["position_mm"]["p100"] < 0.01
    assert said["untold"] == []


def test_frames_elsewhere_millimetres_noise_and_glitches():
    rng = np.random.default_rng(0)
    T_world_base, T_ee_camera = (
        transform([0.1, 0.4, 1.0], [1.0, 2.0, 0.3]),
        transform([0.3, 0.2, 0.5], [0.1, 0.02, 0.03]),
    )
    T = T_world_base @ T_BASE_EE @ T_ee_camera
    T[:, :3, 3] += rng.normal(scale=1e-3, size=(len(T), 3))
    T[:4, :3, 3] += 0.5
    values = written(T, "quaternion w, x, y, z")
    values[:, :3] *= 1e3
    found = checked(values)
    assert found is not None and found.agrees
    said = found.report()
    assert (said["ee_frame"], said["base_frame"], said["undetermined"]) == ("", "", 0)
    np.testing.assert_allclose(said["T_ee_recorded"], T_ee_camera, atol=3e-3)
    np.testing.assert_allclose(said["T_recorded_base"], T_world_base, atol=3e-3)
    assert 1.0 < said["position_mm"]["p50"] < 2.5
    assert said["position_mm"]["p100"] > 400


def test_a_known_end_effector_is_named_though_the_base_is_elsewhere():
    found = checked(written(transform([0, 0, 0.8], [0.2, 0.1, 0.9]) @ T_BASE_EE, "rotation vector"))
    assert found is not None
    assert (found.report()["ee_frame"], found.report()["base_frame"]) == ("panda_hand_tcp", "")


def test_turns_about_one_axis_leave_numbers_open():
    q = np.tile(PANDA.home, (40, 1))
    q[:, 0] += np.linspace(-0.5, 0.5, 40)
    kinematics = kinematics_of(PANDA)
    A = kinematics.fk_batch(q)
    B = transform([0.1, 0.4, 1.0], [1.0, 2.0, 0.3]) @ A @ transform([0.3, 0.2, 0.5], [0.1, 0.02, 0.03])
    bases = {name: inverse(T) for name, T in kinematics.rigid_to("panda_link0").items()}
    fit = fit_frames(A, B, bases, kinematics.rigid_to("panda_hand_tcp"), refine=True)
    assert fit.undetermined == 2  # a turn about the axis and a way along it
    assert fit.size(A, B) < 1e-6


@pytest.mark.parametrize(
    ("joints", "motors", "arm", "cause"),
    [
        (Q * np.where(np.arange(7) == 3, -1, 1), MOTORS, PANDA, "m4 turning the other way (--signs 1 1 1 -1 1 1 1)"),
        (Q[:, [0, 1, 3, 2, 4, 5, 6]], MOTORS, PANDA, "another order of the joints (--joints m1 m2 m4 m3 m5 m6 m7)"),
        (np.rad2deg(Q), MOTORS, PANDA, "joints in degrees (--units deg)"),
        (Q, MOTORS, Arm.preset("xarm7"), "another arm, panda (--arm panda)"),
    ],
)
def test_a_single_mistake_is_named(joints: np.ndarray, motors: Motors, arm: Arm, cause: str):
    found = checked(written(T_BASE_EE, "roll, pitch, yaw in rad")[:, :6], arm, motors, joints)
    assert found is not None and not found.agrees and found.certain
    assert found.finding().endswith(f"They agree with {cause}.")


def test_an_arm_that_stands_still_tells_nothing():
    q = np.tile(PANDA.home, (30, 1))
    found = checked(written(kinematics_of(PANDA).fk_batch(q), "rotation vector"), joints=q)
    assert found is not None
    assert found.untold == MOTORS.joints


def test_a_joint_that_does_not_move_is_told():
    q = Q.copy()
    q[:, 4] = 0.0
    found = checked(written(kinematics_of(PANDA).fk_batch(q), "rotation vector"), joints=q)
    assert found is not None and found.agrees
    assert found.untold == ("m5",)


@pytest.fixture(scope="module")
def droid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset with DROID's columns: joints and gripper, and the flange's pose beside them."""
    root = tmp_path_factory.mktemp("droid") / "droid"
    names = [*(f"joint_{i}" for i in range(7)), "gripper"]
    features = {
        "action": {"dtype": "float32", "shape": (8,), "names": names},
        "observation.state": {"dtype": "float32", "shape": (8,), "names": names},
        "observation.state.cartesian_position": {
            "dtype": "float32",
            "shape": (6,),
            "names": ["x", "y", "z", "roll", "pitch", "yaw"],
        },
    }
    dataset = LeRobotDataset.create("lab/droid", 15, features, root=root, robot_type="franka", use_videos=False)
    for path in paths(PANDA, 0):
        poses = written(kinematics_of(PANDA).fk_batch(path) @ FLANGE, "roll, pitch, yaw in rad").astype(np.float32)
        for t, q in enumerate(path.astype(np.float32)):
            command = np.append(path[min(t + 1, len(path) - 1)], 0.0).astype(np.float32)
            frame = {"action": command, "observation.state": np.append(q, 0.0).astype(np.float32), "task": "move"}
            dataset.add_frame(frame | {"observation.state.cartesian_position": poses[t]})
        dataset.save_episode()
    dataset.finalize()
    return root


def verified(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["er-il", "verify", *map(str, arguments)])
    try:
        main()
    except SystemExit as left:
        return int(left.code or 0)
    return 0


def test_verify_finds_the_poses_of_droid(droid: Path, tmp_path: Path, monkeypatch, capsys, one_worker):
    joints = [f"joint_{i}" for i in range(7)]
    encoded, wrong = tmp_path / "encoded", tmp_path / "wrong"
    run("er-il", "encode", str(droid), "--to", "erj", "--arm", "panda", "--joints", *joints, "--out", str(encoded))
    assert verified(monkeypatch, encoded, "--out", tmp_path / "report") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "observation.state.cartesian_position (x to yaw) holds end-effector poses" in said
    assert "they are poses of panda_link8, in panda_link0" in said
    report = json.loads((tmp_path / "report/report.json").read_text())["arms"]["panda"]["poses"]
    assert report["joints"] == "measured"
    assert report["position_mm"]["p99"] < 0.1

    swapped = [joints[i] for i in (0, 1, 4, 3, 2, 5, 6)]
    run("er-il", "encode", str(droid), "--to", "joint", "--arm", "panda", "--joints", *swapped, "--out", str(wrong))
    assert verified(monkeypatch, wrong, "--out", tmp_path / "report") == 2
    assert f"--joints {' '.join(joints)}" in capsys.readouterr().err

    column = "observation.state.cartesian_position"
    assert verified(monkeypatch, encoded, "--poses", column, "x", "y", "--out", tmp_path / "report") == 2
    assert "2 numbers are no pose" in capsys.readouterr().err
    assert verified(monkeypatch, encoded, "--poses", "observation.pose", "--out", tmp_path / "report") == 2
    assert column in capsys.readouterr().err
