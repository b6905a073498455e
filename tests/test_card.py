import pytest
from foreign import ARMS, NAMES

from er_il import Arm
from er_il.datasets.card import dimension_meaning
from er_il.datasets.wiring import read_wirings, wire
from er_il.spaces.layout import Layout
from er_il.spaces.registry import make_arm_space
from er_il.spaces.spec import ACTION

PANDA = Arm.preset("panda")
POSITION, QUATERNION = ["end-effector position [m]"], ["end-effector orientation, unit quaternion"]
MATRIX = ["end-effector orientation, element of the rotation matrix"]
MOVES = [
    *(["change of the end-effector position [m]"] * 3),
    *(["change of the end-effector orientation, rotation vector [rad]"] * 3),
]


@pytest.mark.parametrize(
    ("kind", "rotation", "meanings"),
    [
        ("joint", "quat", [f"joint `{joint}` [rad]" for joint in PANDA.joints]),
        ("task", "quat", POSITION * 3 + QUATERNION * 4),
        ("erj", "rot6d", [*POSITION * 3, *MATRIX * 6, "joint `panda_joint1` [rad]"]),
        ("era", "quat", [*POSITION * 3, *QUATERNION * 4, "redundancy [rad]"]),
        ("delta_joint", "quat", [f"change of joint `{joint}` [rad]" for joint in PANDA.joints]),
        ("delta_task", "quat", MOVES),
        ("delta_erj", "quat", [*MOVES, "change of joint `panda_joint1` [rad]"]),
        ("delta_era", "quat", [*MOVES, "change of the redundancy [rad]"]),
    ],
)
def test_every_dimension_is_described(kind, rotation, meanings):
    layout = Layout.of_space(make_arm_space(kind, PANDA, rotation=rotation))
    assert [dimension_meaning(layout, name) for name in layout.encoded_names] == [*meanings, "as in the source"]


def test_arms_of_a_robot_are_described_in_the_units_of_their_dimensions(tmp_path):
    (tmp_path / "arms.yaml").write_text(ARMS)
    features = {ACTION: {"shape": (len(NAMES),), "names": list(NAMES)}}
    joint, delta = (
        wire(read_wirings(tmp_path / "arms.yaml"), features, kind, "quat") for kind in ("joint", "delta_erj")
    )
    assert dimension_meaning(joint, "right_joint_2.pos") == "joint `joint2` [deg]"
    assert dimension_meaning(delta, "right_joint1.delta") == "change of joint `joint1` [rad]"
    assert dimension_meaning(delta, "left_ee.drx") == MOVES[3]
    assert dimension_meaning(delta, "lift.height") == "as in the source"
