"""Robot files from others: what is no arm is refused in one line, before a kinematics library sees it."""

import re
from pathlib import Path

import numpy as np
import pytest
from chains import write_chain
from hypothesis import given, settings
from hypothesis import strategies as st

from er_il import Arm, ErIlError
from er_il.arms.robot_tree import LINKS
from er_il.kinematics.solver import kinematics_of
from er_il.support.errors import ArmError

JOINT4 = '<joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/>'
AXIS, LIMIT = '<axis xyz="0 0 1"/>', '<limit lower="-2.8" upper="2.8" effort="10" velocity="2.0"/>'
BOMB = '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]><robot name="&b;">'

# What is replaced in a good file, by what, and what is said of it.
DAMAGES = {
    "prismatic": (
        JOINT4,
        JOINT4.replace("revolute", "prismatic"),
        "joint j4 is prismatic; er_il's arms have joints tha",
    ),
    "planar": (JOINT4, JOINT4.replace("revolute", "planar"), "the joint j4 is planar"),
    "floating": (JOINT4, JOINT4.replace("revolute", "floating"), "the joint j4 is floating"),
    "kind": (
        JOINT4,
        JOINT4.replace("revolute", "hinge"),
        "joint j4 is of the type 'hinge'. Valid: revolute, continuous",
    ),
    "mimic": (JOINT4, JOINT4 + '<mimic joint="j3"/>', "j4 mimic other joints on the way to 'tool'"),
    "loop": ('parent link="l0"', 'parent link="l3"', "l1, l2, l3, l4, l5, l6, l7, tool form a loop"),
    "own child": (JOINT4, JOINT4.replace("l3", "l4"), "l4, l5, l6, l7, tool form a loop"),
    "two roots": ('<link name="l0"/>', '<link name="l0"/><link name="table"/>', "no joint moves l0, table"),
    "two joints for a link": (JOINT4, JOINT4.replace('"l4"', '"l3"'), "several joints move l3"),
    "parent unknown": (JOINT4, JOINT4.replace("l3", "l33"), "the joint j4 has a parent link 'l33', which is not there"),
    "no parent": (JOINT4, JOINT4.replace('<parent link="l3"/>', ""), "the joint j4 has no parent link"),
    "no child": (JOINT4, JOINT4.replace('<child link="l4"/>', ""), "the joint j4 has no child link"),
    "same links": ('<link name="l2"/>', '<link name="l2"/><link name="l2"/>', "several links named l2"),
    "same joints": ('"j5"', '"j4"', "several joints named j4"),
    "no name": ('name="j4"', "", "a link or a joint without a name"),
    "a joint called as a far link": ('name="j4"', 'name="l6"', "a joint and a link named l6 in different places"),
    "the solver's joint": ('name="j4"', 'name="universe"', "the joint universe needs another name"),
    "zero axis": (JOINT4, JOINT4 + '<axis xyz="0 0 0"/>', "the joint j4 has an axis of length zero"),
    "axis of NaN": (
        JOINT4,
        JOINT4 + '<axis xyz="0 nan 1"/>',
        "j4 has xyz='0 nan 1' in <axis>; it needs 3 finite numbers",
    ),
    "origin of two numbers": (
        JOINT4,
        JOINT4 + '<origin xyz="0 1"/>',
        "j4 has xyz='0 1' in <origin>; it needs 3 finite",
    ),
    "infinite turn": (JOINT4, JOINT4 + '<origin rpy="0 inf 1"/>', "j4 has rpy='0 inf 1' in <origin>"),
    "millimetres": (JOINT4, JOINT4 + '<origin xyz="0 0 3e5"/>', "j4 lies 300000 m from the one before"),
    "no limits": (LIMIT, "", "the joint j1 has no limits"),
    "limits of NaN": (LIMIT, LIMIT.replace("-2.8", "nan"), "j1 has lower='nan' in <limit>; it needs one finite number"),
    "limits of words": (LIMIT, LIMIT.replace("-2.8", "low"), "j1 has lower='low' in <limit>"),
    "swapped limits": (
        LIMIT,
        LIMIT.replace("-2.8", "9"),
        "j1 is limited to [9, 2.8] rad and 2 rad/s: every arm joint ne",
    ),
    "huge limits": (LIMIT, LIMIT.replace("2.8", "1e300"), "every arm joint needs lower < upper, within 1000 turns"),
    "bomb": ('<robot name="chain7">', BOMB, "declares the XML entity 'a'; a URDF needs none"),
    "truncated": ("</robot>", "", "is not valid XML (no element found"),
    "no XML": ("<robot", "robot", "is not valid XML (syntax error"),
    "unknown encoding": ("<robot", '<?xml version="1.0" encoding="klingon"?><robot', "is not valid XML"),
    "depth": ("</robot>", "<a>" * 5000 + "</a>" * 5000 + "</robot>", "nested deeper than 100"),
    "many links": ("</robot>", "".join(f'<link name="x{i}"/>' for i in range(LINKS)) + "</robot>", "has 1009 links"),
    "many bytes": ("</robot>", " " * 2**24 + "</robot>", "larger than 16 MiB"),
}


def good(folder: Path) -> str:
    return write_chain(folder / "good.urdf", 7).read_text()


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_robot_file_is_refused_in_one_line(damage: str, tmp_path: Path) -> None:
    old, new, message = DAMAGES[damage]
    text, path = good(tmp_path), tmp_path / "arm.urdf"
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(ArmError, match=re.escape(message)) as caught:
        Arm.from_urdf(path, ee_frame="tool")
    assert "\n" not in str(caught.value) and "arm.urdf" in str(caught.value)


def test_what_is_wrong_beside_the_arm_does_not_matter(tmp_path: Path) -> None:
    """A gripper that slides and mimics, a mesh that is missing, and masses of NaN do not concern its kinematics."""
    text, path = good(tmp_path), tmp_path / "arm.urdf"
    finger = '<joint name="f" type="prismatic"><parent link="tool"/><child link="finger"/><mimic joint="j1"/></joint>'
    body = (
        '<link name="l2"><inertial><mass value="nan"/></inertial><visual><geometry><mesh filename="no.stl"/></geometry>'
    )
    edited = text.replace("</robot>", f'<link name="finger"/>{finger}</robot>')
    path.write_text(edited.replace('<link name="l2"/>', f"{body}</visual></link>"))
    arm, plain = Arm.from_urdf(path, ee_frame="tool"), Arm.from_urdf(tmp_path / "good.urdf", ee_frame="tool")
    assert arm.fingerprint == plain.fingerprint and arm.joints == plain.joints
    q = np.linspace(-1, 1, 7)
    np.testing.assert_array_equal(kinematics_of(arm).fk(q), kinematics_of(plain).fk(q))


def test_a_lift_under_the_arm_stays_at_zero_where_its_joints_are_named(tmp_path: Path) -> None:
    text, path = good(tmp_path), tmp_path / "arm.urdf"
    path.write_text(text.replace('"j1" type="revolute"', '"j1" type="prismatic"'))
    names = [f"j{i}" for i in range(2, 8)]
    lifted = Arm.from_urdf(path, ee_frame="tool", joints=names)
    fixed = Arm.from_urdf(tmp_path / "good.urdf", ee_frame="tool", joints=names)
    assert lifted.fingerprint == fixed.fingerprint


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_any_damage_leaves_an_arm_or_one_line(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    folder = tmp_path_factory.getbasetemp()
    words = re.split(r'(["<>/= ])', good(folder))
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(words) - 1))
        words[at] = data.draw(st.sampled_from(["", "nan", "-1e999", "j3", "l3", "0", "<", "mimic", *words[:40]]))
    path = folder / "mutated.urdf"
    path.write_text("".join(words))
    try:
        arm = Arm.from_urdf(path, ee_frame="tool")
    except ErIlError as error:
        assert "\n" not in str(error)
        return
    assert np.isfinite(kinematics_of(arm).fk(arm.home)).all() and np.all(arm.lower < arm.upper)
