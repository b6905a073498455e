import pickle
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from chains import write_chain

from er_il import Arm, ArmAngleFrames
from er_il.arms.panda8 import panda8_urdf
from er_il.arms.urdf import example_robot_data
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import ArmError, ErIlError, UnknownNameError

PANDA = Arm.preset("panda")


def test_the_panda():
    assert PANDA.dof == 7 and PANDA.redundancy == 1
    assert PANDA.redundant == ("panda_joint1",)
    np.testing.assert_allclose(PANDA.upper, [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973])
    np.testing.assert_allclose(PANDA.velocity, [2.175] * 4 + [2.61] * 3)
    assert not any(array.flags.writeable for array in (PANDA.lower, PANDA.upper, PANDA.velocity, PANDA.home))


def test_a_preset_is_one_object_and_unknown_ones_name_the_valid():
    assert Arm.preset("panda") is PANDA
    with pytest.raises(UnknownNameError, match=r"^Unknown arm 'pandu'\. Valid: .*panda"):
        Arm.preset("pandu")


def test_an_arm_travels_to_other_processes():
    kinematics_of(PANDA)
    again = pickle.loads(pickle.dumps(PANDA))
    assert again.fingerprint == PANDA.fingerprint
    np.testing.assert_array_equal(again.home, PANDA.home)


def test_joints_are_found_in_order_from_base_to_end_effector(tmp_path):
    arm = Arm.from_urdf(write_chain(tmp_path / "a.urdf", 8, order=[7, 2, 0, 5, 1, 3, 6, 4]), ee_frame="tool")
    assert arm.joints == tuple(f"j{i}" for i in range(1, 9))
    assert arm.redundant == ("j1", "j2")
    np.testing.assert_allclose(arm.home, 0.0)
    part = Arm.from_urdf(arm.urdf, base_frame="l1", ee_frame="l7")
    assert part.joints == tuple(f"j{i}" for i in range(2, 8))


def test_joints_outside_the_arm_stay_at_zero(tmp_path):
    urdf = write_chain(tmp_path / "a.urdf", 8)
    whole = Arm.from_urdf(urdf, ee_frame="tool")
    upper = Arm.from_urdf(urdf, ee_frame="tool", joints=[f"j{i}" for i in range(2, 9)])
    q = np.linspace(0.1, 0.8, 7)
    np.testing.assert_allclose(kinematics_of(upper).fk(q), kinematics_of(whole).fk(np.r_[0.0, q]))


def test_the_fingerprint_tells_geometries_apart(tmp_path):
    first = Arm.from_urdf(write_chain(tmp_path / "a.urdf", 7, seed=1), ee_frame="tool")
    same = Arm.from_urdf(write_chain(tmp_path / "b.urdf", 7, seed=1), ee_frame="tool", name="other")
    other = Arm.from_urdf(write_chain(tmp_path / "c.urdf", 7, seed=2), ee_frame="tool")
    assert first.fingerprint == same.fingerprint != other.fingerprint


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"^Cannot read the URDF .*arm\.urdf: No such file or directory\.$"),
        ("<robot", r"^.*arm\.urdf is not valid XML \(.*\)\.$"),
        ("<mujoco/>", r"^.*arm\.urdf is not a URDF: it has no <robot> with links\.$"),
        ('<robot name="r"/>', r"^.*arm\.urdf is not a URDF"),
        ('<robot name="r"><link name="a"/><link name="b"/></robot>', r"^arm\.urdf describes no single tree of links"),
        (
            '<robot name="r"><link name="tool"/></robot>',
            r"^No movable joint lies between 'tool' and 'tool' in arm\.urdf",
        ),
    ],
)
def test_bad_files_are_refused_with_one_line(tmp_path, text, message):
    path = tmp_path / "arm.urdf"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ArmError, match=message) as caught:
        Arm.from_urdf(path, ee_frame="tool")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"ee_frame": "hand"}, r"^chain\.urdf has no end-effector frame 'hand'\. Its links: l0, l1, "),
        ({"base_frame": "world"}, r"^chain\.urdf has no base frame 'world'\. Its links: l0, "),
        ({"joints": ["j1", "j1"]}, r"^A joint is named twice in j1, j1\.$"),
        ({"joints": ["j1", "j0"]}, r"^j0: not between 'l0' and 'tool' in chain\.urdf\. Movable joints there: j1, "),
        ({"redundant": ["j9"]}, r"^Redundant joints j9 are not among j1, "),
        ({"redundant": ["j1", "j2"]}, r"^chain7 has 7 joints, so ERJ commands 1 of them, not 2 \(j1, j2\)\.$"),
        ({"home": [0.0] * 6}, r"^The home posture of chain7 needs 7 angles within the joint limits\.$"),
        ({"home": [9.0] * 7}, r"^The home posture of chain7"),
        ({"angle_frames": ArmAngleFrames("l1", "elbow", "l5")}, r"^chain7 has no link 'elbow'\. Its links: l0, "),
    ],
)
def test_what_does_not_fit_the_file_is_refused_with_what_would(tmp_path, arguments, message):
    urdf = write_chain(tmp_path / "chain.urdf", 7)
    with pytest.raises(ArmError, match=message):
        Arm.from_urdf(urdf, **{"ee_frame": "tool", **arguments})


def test_joints_need_a_range_and_a_speed(tmp_path):
    for name, arguments in [("still", {"velocity": 0.0}), ("narrow", {"limits": (1.0, 1.0)})]:
        with pytest.raises(
            ArmError,
            match=r"\.urdf: the joint j1 is limited to .*: every arm joint needs lower < upper, .* velocity limit > 0",
        ):
            Arm.from_urdf(write_chain(tmp_path / f"{name}.urdf", 7, **arguments), ee_frame="tool")


def test_missing_models_are_named():
    with pytest.raises(ErIlError, match=r"^example-robot-data has no file 'no_such/robot\.urdf'\.$"):
        example_robot_data("no_such/robot.urdf")


def test_continuous_joints_get_a_turn_to_either_side(tmp_path):
    endless = Arm.from_urdf(write_chain(tmp_path / "a.urdf", 7, kind="continuous"), ee_frame="tool")
    np.testing.assert_allclose(endless.upper, 2 * np.pi)
    np.testing.assert_allclose(endless.lower, -2 * np.pi)
    np.testing.assert_allclose(endless.velocity, 2.0)
    limited = Arm.from_urdf(write_chain(tmp_path / "b.urdf", 7), ee_frame="tool")
    q = np.linspace(-2, 2, 7)
    np.testing.assert_allclose(kinematics_of(endless).fk(q), kinematics_of(limited).fk(q))


def test_the_panda_with_eight_joints_is_a_panda_on_a_bending_base():
    panda8 = Arm.preset("panda8")
    assert panda8.dof == 8 and panda8.redundant == ("panda_base_joint2", "panda_joint1")
    np.testing.assert_allclose(panda8.upper, [1.7628, *PANDA.upper])
    q = PANDA.home + 0.2
    upright = kinematics_of(panda8).fk(np.r_[0.0, q])
    on_top = kinematics_of(PANDA).fk(q)
    on_top[2, 3] += 0.316
    np.testing.assert_allclose(upright, on_top, atol=1e-9)
    bent = kinematics_of(panda8).frame_pose(np.r_[np.pi / 2, q], "panda_link1")
    np.testing.assert_allclose(bent[:3, 3], [0.316, 0.0, 0.333], atol=1e-9)
    np.testing.assert_allclose(bent[:3, 2], [1.0, 0.0, 0.0], atol=1e-9)


def test_the_generated_urdf_is_written_once_and_finds_its_meshes(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = panda8_urdf()
    assert tmp_path in path.parents and path.name == "panda8.urdf"
    before = path.stat().st_mtime_ns
    assert panda8_urdf() == path and path.stat().st_mtime_ns == before
    meshes = {mesh.get("filename", "") for mesh in ET.parse(path).iter("mesh")}
    assert meshes and all(Path(mesh).is_file() for mesh in meshes)


def test_the_xarm7s_frames_are_its_shoulder_elbow_and_wrist():
    # The maker's data sheet: 0.267 to the shoulder, 0.293 up and 0.0525 aside to the elbow.
    xarm7 = Arm.preset("xarm7")
    frames = xarm7.angle_frames
    assert xarm7.dof == 7 and frames is not None
    kinematics = kinematics_of(xarm7)
    np.testing.assert_allclose(kinematics.frame_pose(np.zeros(7), frames.shoulder)[:3, 3], [0, 0, 0.267], atol=1e-4)
    np.testing.assert_allclose(kinematics.frame_pose(np.zeros(7), frames.elbow)[:3, 3], [0.0525, 0, 0.56], atol=1e-4)
    np.testing.assert_allclose(kinematics.fk(xarm7.home)[:3, 2], [0, 0, -1], atol=1e-4)  # the tool points down
