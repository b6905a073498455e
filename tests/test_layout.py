import numpy as np
import pytest
from chains import chain_arm
from foreign import ARMS, LENGTHS, NAMES, bimanual, paths
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.arms.portable import arm_from_spec
from er_il.datasets.schema import dimension_names
from er_il.datasets.wiring import Wiring, read_wirings, wire
from er_il.spaces.action_space import make_action_space
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError, ErIlError, SpecError, UnknownNameError

PANDA = Arm.preset("panda")
FEATURES = {ACTION: {"dtype": "float32", "shape": (len(NAMES),), "names": list(NAMES)}}


@pytest.fixture(scope="module")
def arms(tmp_path_factory):
    path = tmp_path_factory.mktemp("arms") / "arms.yaml"
    path.write_text(ARMS)
    return read_wirings(path)


def _vectors(episode=0):
    values = bimanual()[episode]
    return np.stack([values[name] for name in NAMES], axis=1)


def test_motors_are_signs_then_offsets_then_units():
    motors = Motors(("a", "b"), "deg", (1, -1), (0, 90))
    assert np.allclose(motors.angles([180, 30]), [np.pi, np.pi / 3])
    assert np.allclose(motors.values(motors.angles([17, -23])), [17, -23])
    assert Motors.from_spec(motors.spec()) == motors


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"units": "grad"}, "Unknown unit 'grad'. Valid: rad, deg."),
        ({"signs": (1,)}, "1 signs were given for 2 joints"),
        ({"signs": (1, 0)}, "A sign is 1 or -1"),
    ],
)
def test_motors_that_cannot_be(values, message):
    with pytest.raises(ErIlError, match=message):
        Motors(("a", "b"), **values)


@pytest.mark.parametrize("kind", ["task", "erj", "era", "delta_erj", "joint"])
def test_each_arm_is_encoded_as_if_it_were_alone(arms, kind):
    layout = wire(arms, FEATURES, kind, "quat")
    encoded = layout.encode(_vectors())
    assert encoded.shape == (LENGTHS[0], len(layout.encoded_names))
    columns = dict(zip(layout.encoded_names, encoded.T, strict=True))
    for name in ("lift.height", "left_gripper.pos", "right_gripper.pos"):
        assert np.array_equal(columns[name], bimanual()[0][name])
    if kind == "joint":
        assert layout.encoded_names == NAMES
        assert np.array_equal(encoded, _vectors())
        return
    for part, q in zip(layout.parts, (paths(PANDA, 0)[0], paths(Arm.preset("xarm7"), 1)[0]), strict=True):
        alone = part.space.encode(q)
        assert np.allclose(np.column_stack([columns[name] for name in part.names]), alone, atol=1e-9)


@pytest.mark.parametrize("kind", ["erj", "delta_erj", "joint"])
def test_decoding_gives_the_robots_own_values_back(arms, kind):
    layout = Layout.from_spec(wire(arms, FEATURES, kind, "rot6d").spec())
    vectors = _vectors()
    actions = layout.encode(vectors)
    for t in range(1, 6):
        decoded = layout.decode(actions[t], vectors[t - 1])
        assert [part.status for part in decoded.parts] == ["ok", "ok"]
        assert np.abs(decoded.vector - vectors[t]).max() < 1e-3  # degrees


def test_what_er_il_records_is_described_by_its_action_space_alone():
    space = make_action_space("erj", PANDA)
    layout = Layout.of_space(space.arm_space)
    assert layout.spec() == space.spec()
    assert Layout.from_spec(space.spec()).spec() == space.spec()
    assert layout.encoded_names == space.names


def test_an_arm_of_a_file_travels_in_the_specification(tmp_path):
    arm = chain_arm(tmp_path, 7)
    joints = tuple(f"m{i}" for i in range(7))
    spec = Layout(joints, (Part("", make_arm_space("erj", arm), Motors(joints)),)).spec()
    arm.urdf.unlink()
    again = arm_from_spec(spec["arms"][0]["arm"])
    assert again.fingerprint == arm.fingerprint
    assert np.array_equal(again.upper, arm.upper)
    assert Layout.from_spec(spec).spec() == spec
    del spec["arms"][0]["motors"]
    with pytest.raises(SpecError, match="motors"):
        Layout.from_spec(spec)


def test_episodes_agree_about_the_sign_of_one_orientation():
    """The hand points where the home posture's reference cannot decide: half a turn away from it."""
    q = np.tile(PANDA.home, (40, 1))
    q[:, 6] += np.pi - 0.1 + np.linspace(0, 0.2, 40)  # turns by half a turn, seen from the home pose
    q[:, 6] -= 2 * np.pi * (q[:, 6] > PANDA.upper[6])
    q = np.clip(q, PANDA.lower, PANDA.upper)
    q[:, 4] += np.linspace(-0.4, 0.4, 40)
    home = Layout.of_space(make_arm_space("task", PANDA))
    layout = home.fitted(np.column_stack([q, np.ones(len(q))]))
    vectors = np.column_stack([q, np.ones(len(q))])

    def first(of, row):
        return of.encode(vectors[row : row + 1])[0, 3:7]

    def agreeing(of):
        quaternions = np.array([first(of, row) for row in range(len(q))])
        return np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0)

    turn = Rotation.from_matrix(home.parts[0].space.fk(PANDA.home)[:3, :3]).inv() * Rotation.from_matrix(
        home.parts[0].space.fk(q[20])[:3, :3]
    )
    assert turn.magnitude() > 2.9
    assert agreeing(layout)
    assert not agreeing(home)
    assert Layout.from_spec(layout.spec()).spec() == layout.spec()
    near = np.column_stack([paths(PANDA, 0)[0], np.ones(LENGTHS[0])])
    assert home.fitted(near).spec() == home.spec()  # the common case stays comparable


def test_names_of_dimensions_in_all_of_lerobots_forms():
    assert dimension_names({"shape": (2,), "names": ["a", "b"]}) == ("a", "b")
    assert dimension_names({"shape": (2,), "names": {"motors": ["a", "b"]}}) == ("a", "b")
    assert dimension_names({"shape": (2,), "names": None}) == ("0", "1")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("left: panda", "needs one entry an arm"),
        ("left: {units: deg}", "wiring of arm 'left' lacks arm"),
        ("left: {arm: panda, unit: deg}", "wiring of arm 'left' has no unit. Valid: arm, label, ee_frame"),
        ("left: {arm: panda, joints: a}", "joints is 'a': .*valid tuple"),
        ("left: {arm: [panda", "is not valid YAML"),
    ],
)
def test_files_of_arms_that_cannot_be_read(tmp_path, text, message):
    path = tmp_path / "arms.yaml"
    path.write_text(text)
    with pytest.raises(ErIlError, match=message):
        read_wirings(path)


@pytest.mark.parametrize(
    ("wiring", "error", "message"),
    [
        (
            Wiring(arm="ur5"),
            UnknownNameError,
            "Unknown arm 'ur5'. Valid: fr3, gen3, openarm_v1_left, .*, panda, panda8, xarm7, the path of a URDF",
        ),
        (Wiring(arm="panda"), DatasetError, "Which dimensions are the joints of panda"),
        (Wiring(arm="panda", joints=("elbow",)), UnknownNameError, "Unknown dimension of the action 'elbow'. Valid: "),
        (Wiring(arm="panda", joints=NAMES[:3]), DatasetError, "panda has 7 joints .* but 3 dimensions are given"),
        (Wiring(arm="panda", joints=(NAMES[0],) * 7), DatasetError, "one joint only"),
    ],
)
def test_wirings_that_do_not_fit(wiring, error, message):
    with pytest.raises(error, match=message):
        wire([wiring], FEATURES, "erj", "quat")


def test_a_preset_with_another_end_effector_is_an_arm_of_its_own():
    joints = tuple(f"{joint}.pos" for joint in PANDA.joints)
    features = {ACTION: {"shape": (7,), "names": list(joints)}}
    layout = wire([Wiring(arm="panda", ee_frame="panda_link8")], features, "erj", "quat")
    assert layout.parts[0].motors.joints == joints  # found by the arm's own names
    assert Layout.from_spec(layout.spec()).parts[0].space.arm.ee_frame == "panda_link8"
