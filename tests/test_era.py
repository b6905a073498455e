import json
from pathlib import Path

import numpy as np
import pytest
from chains import chain_arm
from scipy.spatial.transform import Rotation

from er_il import ActionSpace, Arm, Status, from_spec, make_action_space
from er_il.kinematics.arm_angle import STEREO, UP, ArmAngle, ElbowCircle, wrapped
from er_il.kinematics.reference_direction import ReferenceDirection, Stereographic
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.references import fitted
from er_il.spaces.registry import name_of
from er_il.spaces.round_trip import EXACT
from er_il.support.errors import ArmError, SpecError, UnknownNameError

PANDA = Arm.preset("panda")
ANGLE = ArmAngle(PANDA)
DIRECTIONS = {"up": UP, "stereo": STEREO, "tilted": Stereographic((0.6, 0.0, 0.8), (0.0, 1.0, 0.0))}


def test_the_arm_angle_is_zero_at_the_top_and_follows_the_equation():
    kinematics = make_action_space("era", PANDA).kinematics
    circle = ANGLE.circle(PANDA.home)
    assert np.isclose(circle.angle, 0.0, atol=1e-9)
    angles = np.linspace(-np.pi, np.pi, 73)
    heights = [circle.elbow(angle)[2] for angle in angles]
    assert angles[np.argmax(heights)] == 0.0
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(PANDA.lower, PANDA.upper)
        elbow = kinematics.frame_pose(q, "panda_link4")[:3, 3]
        circle = ANGLE.circle(q)
        np.testing.assert_allclose(circle.elbow(circle.angle), elbow, atol=1e-9)


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS)
def test_the_slope_of_the_arm_angle_is_its_derivative(direction: ReferenceDirection) -> None:
    angle, rng, h = ArmAngle(PANDA, direction=direction), np.random.default_rng(1), 1e-6
    q = rng.uniform(PANDA.lower, PANDA.upper, (20, PANDA.dof))
    values, scale, slopes = angle.linearise_batch(kinematics_of(PANDA).chain.walk(q))
    for row, each in enumerate(q):
        at = angle.linearise(each)
        ahead, behind = angle.wrapped(each + h * np.eye(7)), angle.wrapped(each - h * np.eye(7))
        difference = at.scale * wrapped(ahead - behind) / (2 * h)
        np.testing.assert_allclose(at.derivative[0], difference, atol=1e-6)
        np.testing.assert_allclose(slopes[0, :, row], difference, atol=1e-6)
        assert np.isclose(at.values[0], angle.wrapped(each[None])[0], rtol=0, atol=1e-12)
        np.testing.assert_allclose([at.values[0], at.scale], [values[0, row], scale[row]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS)
def test_a_reference_is_a_right_handed_frame_across_every_axis(direction: ReferenceDirection) -> None:
    for axis in Rotation.random(50, rng=np.random.default_rng(0)).as_matrix()[:, :, 0]:
        top, side, spin = direction.of(tuple(axis.tolist()))
        np.testing.assert_allclose(np.cross(top, side), axis, atol=1e-9)
        np.testing.assert_allclose([np.linalg.norm(top), axis @ top, axis @ spin], [1, 0, 0], atol=1e-9)


def _published_iiwa(path: Path) -> Arm:
    """The KUKA LBR iiwa 14 of rpiRobotics/stereo-sew: its distances and axes, with more than a turn of every joint."""
    heights, axes = (0.36, 0, 0.42, 0, 0.4, 0, 0), ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
    links = "".join(f'<link name="l{i}"/>' for i in range(8)) + '<link name="tool"/>'
    joints = "".join(
        f'<joint name="j{i + 1}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 {z}"/><axis xyz="{axis}"/><limit lower="-4" upper="4" effort="10" velocity="2"/></joint>'
        for i, (z, axis) in enumerate(zip(heights, axes, strict=True))
    )
    joints += '<joint name="t" type="fixed"><parent link="l7"/><child link="tool"/><origin xyz="0 0 0.126"/></joint>'
    path.write_text(f'<robot name="iiwa">{links}{joints}</robot>')
    return Arm.from_urdf(path, ee_frame="tool")


def test_the_published_example_of_the_stereographic_angle_has_its_eight_solutions(tmp_path: Path) -> None:
    """rpiRobotics/stereo-sew, robot_examples/kuka.m: all of the eight solutions at psi = pi/6 are exact."""
    arm, psi = _published_iiwa(tmp_path / "iiwa.urdf"), np.pi / 6
    e_t, e_r = (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)
    angle, kinematics = ArmAngle(arm, direction=Stereographic(e_t, e_r)), kinematics_of(arm)
    T_base_ee = np.eye(4)
    T_base_ee[:3, :3], T_base_ee[:3, 3] = Rotation.from_euler("x", np.pi / 4).as_matrix(), (0.2, 0.3, 0.4)

    # The elbow by the paper's construction, with cross products, and the law of cosines.
    shoulder = np.array([0, 0, 0.36])
    span = T_base_ee[:3, 3] - 0.126 * T_base_ee[:3, 2] - shoulder
    axis = span / np.linalg.norm(span)
    across = np.cross(np.cross(axis - e_t, e_r), axis)
    spoke = Rotation.from_rotvec(psi * axis).apply(across / np.linalg.norm(across))
    foot = (0.42**2 - 0.4**2 + span @ span) / (2 * np.linalg.norm(span))
    elbow = shoulder + foot * axis + np.sqrt(0.42**2 - foot**2) * spoke

    found, rng = [], np.random.default_rng(0)
    for _ in range(100):
        ik = kinematics.solve(T_base_ee, rng.uniform(-np.pi, np.pi, 7), angle, [psi])
        if ik.status is Status.OK and not any(np.abs(wrapped(ik.q - q)).max() < 1e-3 for q in found):
            found.append(ik.q)
            assert max(kinematics.pose_error(T_base_ee, ik.q)) < 1e-6
            np.testing.assert_allclose(angle.wrapped(ik.q[None]), psi, atol=1e-6)
            np.testing.assert_allclose(kinematics.frame_pose(ik.q, "l4")[:3, 3], elbow, atol=1e-6)
    assert len(found) == 8


def test_the_stereographic_angle_goes_on_where_the_axis_passes_the_vertical() -> None:
    """The wrist passes over the shoulder, from ahead to behind: the highest point of the circle changes sides."""
    q = PANDA.home + np.linspace(0, 1, 200)[:, None] * np.array([0, -1.5, 0.01, 0, 0.01, 0, 0])
    kinematics = kinematics_of(PANDA)
    shoulder, _, wrist = (kinematics.fk_batch(q, link)[:, :3, 3] for link in ANGLE.frames)
    assert np.sign(wrist - shoulder)[[0, -1], 0].tolist() == [1, -1]
    steps = {
        name: np.abs(np.diff(make_action_space(name, PANDA).encode(q)[:, 7])).max() for name in ("era", "era@stereo")
    }
    assert steps["era@stereo"] < 0.05 < 0.5 < steps["era"]


@pytest.mark.parametrize("name", ["era@stereo", "delta_era@stereo"])
def test_a_space_with_the_stereographic_reference_comes_back_from_its_spec(name: str) -> None:
    space = make_action_space(name, PANDA)
    spec = json.loads(json.dumps(space.spec()))
    again = from_spec(spec)
    assert (name_of(again.arm_space, PANDA), again.names) == (name, space.names)
    q = PANDA.home + 0.2 * np.sin(np.arange(7) + np.linspace(0, 1, 30)[:, None])
    np.testing.assert_array_equal(again.encode(q), space.encode(q))
    assert not np.allclose(make_action_space(name.removesuffix("@stereo"), PANDA).encode(q), space.encode(q), atol=1e-3)
    with pytest.raises(SpecError, match=r"^The action spec measures the arm angle by .*1\.0, 0\.0.*, but 'panda' by "):
        from_spec({**spec, "arm_angle": {**spec["arm_angle"], "e_t": [1.0, 0.0, 0.0]}})


def test_a_reference_that_the_arm_angle_does_not_have_is_refused() -> None:
    with pytest.raises(UnknownNameError, match=r"^Unknown action space 'era@down'\. Valid: .*era@stereo"):
        make_action_space("era@down", PANDA)


def test_the_commanded_arm_angle_is_reached_although_the_wrist_moves_with_it():
    space = make_action_space("era", PANDA)
    action = space.encode(PANDA.home)
    wrists = []
    for phi in np.radians([-40, -20, 20, 40]):
        decoded = space.decode(np.concatenate([action[:7], [phi, 1.0]]), PANDA.home)
        assert decoded.status is Status.OK
        circle = ANGLE.circle(decoded.q)
        assert np.isclose(circle.angle, phi, atol=1e-3)
        assert max(space.kinematics.pose_error(space.fk(PANDA.home), decoded.q)) < 1e-3
        wrists.append(space.kinematics.frame_pose(decoded.q, "panda_link6")[:3, 3])
    assert np.ptp(wrists, axis=0).max() > 0.01


def test_an_arm_angle_out_of_reach_is_said():
    space = make_action_space("era", PANDA)
    action = space.encode(PANDA.home)
    action[7] = np.pi  # elbow straight down: the Panda's limits forbid it here
    decoded = space.decode(action, PANDA.home)
    assert decoded.status is not Status.OK


def test_the_arm_angle_is_continuous_past_half_a_turn_and_any_turn_decodes():
    space = make_action_space("era", PANDA)
    rng = np.random.default_rng(0)
    phi = np.linspace(np.radians(150), np.radians(210), 61)
    q = _with_arm_angle(space, phi, rng)
    encoded = space.encode(q)[:, 7]
    np.testing.assert_allclose(np.diff(encoded), np.diff(phi), atol=2e-3)
    action = space.encode(q[20])
    for turn in (-2, 1, 3):
        other = action.copy()
        other[7] += 2 * np.pi * turn
        np.testing.assert_allclose(space.decode(other, q[20] + 0.01).q, q[20], atol=EXACT)


def test_demos_agree_about_the_turn_of_one_arm_angle():
    """One demo stays below half a turn, another one beyond it: as fitted to both, nothing is torn apart between."""
    home = make_action_space("era", PANDA)
    q = _with_arm_angle(home, np.linspace(np.radians(150), np.radians(210), 61), np.random.default_rng(0))
    demos = (q[:25], q[36:])
    apart = [home.encode(demo)[:, 7] for demo in demos]
    assert np.abs(apart[1].mean() - apart[0].mean()) > np.pi
    space = fitted(home.arm_space, np.concatenate(demos))
    together = np.concatenate([space.encode(demo)[:, 7] for demo in demos])
    np.testing.assert_allclose(np.ptp(together), np.radians(60), atol=5e-3)
    assert np.all(np.diff(together) > 0)
    decoded = space.decode(space.encode(demos[1])[0], demos[1][0] + 0.01)
    np.testing.assert_allclose(decoded.q, demos[1][0], atol=EXACT)


def _with_arm_angle(space: ActionSpace, phi: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A joint path through arm angles around half a turn, at whatever pose allows it."""
    for _ in range(500):
        q = rng.uniform(PANDA.lower, PANDA.upper)
        path = []
        for angle in phi:
            ik = space.kinematics.solve(space.fk(q), path[-1] if path else q, ANGLE, [angle])
            if ik.status is not Status.OK or (path and np.abs(ik.q - path[-1]).max() > 0.2):
                break
            path.append(ik.q)
        if len(path) == len(phi):
            return np.array(path)
    raise AssertionError("no pose of the Panda lets its elbow pass the lowest point")


def test_a_vertical_axis_is_counted_from_the_base_frames_x():
    circle = ElbowCircle.through((0.0, 0.0, 0.0), (0.1, 0.1, 0.3), (0.0, 0.0, 0.6))
    assert np.isclose(circle.angle, np.radians(45))
    np.testing.assert_allclose(circle.elbow(circle.angle), [0.1, 0.1, 0.3])


def test_era_needs_one_redundant_joint(tmp_path):
    with pytest.raises(ArmError, match=r"^chain8 has 2 redundant joints; one arm angle fixes only one. Use erj"):
        make_action_space("era", chain_arm(tmp_path, 8))


def test_the_spec_keeps_the_turn_and_the_frames_it_was_made_with():
    space = make_action_space("era", PANDA)
    spec = space.spec()
    turned = from_spec({**spec, "arm_angle": {**spec["arm_angle"], "reference": 2 * np.pi}})
    assert np.isclose(turned.encode(PANDA.home)[7], 2 * np.pi)
    np.testing.assert_allclose(turned.decode(turned.encode(PANDA.home), PANDA.home + 0.05).q, PANDA.home, atol=EXACT)
    with pytest.raises(SpecError, match=r"^The action spec measures the arm angle by .*panda_link3.*, but 'panda' by "):
        from_spec({**spec, "arm_angle": {**spec["arm_angle"], "elbow": "panda_link3"}})
