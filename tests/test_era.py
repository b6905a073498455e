import numpy as np
import pytest
from chains import chain_arm

from er_il import ActionSpace, Arm, Status, from_spec, make_action_space
from er_il.kinematics.arm_angle import ArmAngle, ElbowCircle
from er_il.spaces.references import fitted
from er_il.spaces.round_trip import EXACT
from er_il.support.errors import ArmError, SpecError

PANDA = Arm.preset("panda")
ANGLE = ArmAngle(PANDA)


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


def test_the_slope_of_the_arm_angle_is_its_derivative():
    rng, h = np.random.default_rng(1), 1e-6
    for _ in range(10):
        q = rng.uniform(PANDA.lower, PANDA.upper)
        at = ANGLE.linearise(q)
        ahead, behind = ANGLE.wrapped(q + h * np.eye(7)), ANGLE.wrapped(q - h * np.eye(7))
        np.testing.assert_allclose(at.derivative[0], at.scale * (ahead - behind) / (2 * h), atol=1e-6)
        assert np.isclose(at.values[0], ANGLE.wrapped(q[None])[0], rtol=0, atol=1e-12)


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
    circle = ElbowCircle.through(np.zeros(3), np.array([0.1, 0.1, 0.3]), np.array([0.0, 0.0, 0.6]))
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
