import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from er_il.kinematics.rotation import Quaternion, Rot6d, RotationError, make_rotation
from er_il.support.errors import UnknownNameError

HALF_TURN = np.diag([1.0, -1.0, -1.0])  # a hand that points down: where w >= 0 alone would flip


def turns(degrees: np.ndarray, axis: str = "x") -> np.ndarray:
    return Rotation.from_euler(axis, degrees[:, None], degrees=True).as_matrix()


@pytest.mark.parametrize("code", [Quaternion(), Rot6d()])
def test_decode_inverts_encode(code):
    R = Rotation.random(50, rng=np.random.default_rng(0)).as_matrix()
    decoded = [code.decode(row) for row in code.encode(R)]
    np.testing.assert_allclose(decoded, R, atol=1e-12)


@pytest.mark.parametrize("code", [make_rotation("quat", HALF_TURN), make_rotation("quat", np.eye(3)), Rot6d()])
def test_codes_are_continuous_through_half_a_turn(code):
    steps = np.abs(np.diff(code.encode(turns(np.arange(0, 721, 5.0))), axis=0))
    assert steps.max() < 0.1


def test_quaternions_of_neighbours_do_not_flip_around_the_reference():
    code = make_rotation("quat", HALF_TURN)
    # Each pose encoded alone, as the first of its own trajectory.
    alone = np.array([code.encode(turns(np.array([angle])))[0] for angle in np.arange(100.0, 261.0, 2.0)])
    assert np.abs(np.diff(alone, axis=0)).max() < 0.05
    naive = Rotation.from_matrix(turns(np.arange(100.0, 261.0, 2.0))).as_quat(canonical=True)
    assert np.abs(np.diff(naive, axis=0)).max() > 1.0


def test_quaternion_twins_and_lengths_are_one_rotation():
    q = Rotation.from_euler("xyz", [0.3, -0.4, 2.0]).as_quat()
    for twin in (q, -q, 7.5 * q, 1e-3 * q):
        np.testing.assert_allclose(Quaternion().decode(twin), Quaternion().decode(q), atol=1e-12)


def test_rot6d_of_a_sloppy_policy_becomes_a_rotation():
    noisy = Rot6d().encode(HALF_TURN[None])[0] + np.array([0.1, -0.05, 0.02, 0.08, 0.03, -0.1])
    R = Rot6d().decode(noisy)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(R), 1.0)
    assert np.degrees(np.arccos((np.trace(R.T @ HALF_TURN) - 1) / 2)) < 10


def test_what_stands_for_no_rotation_is_refused():
    with pytest.raises(RotationError, match=r"^a zero quaternion is no rotation$"):
        Quaternion().decode(np.zeros(4))
    for axes in (np.zeros(6), np.array([1.0, 0, 0, 2.0, 0, 0])):
        with pytest.raises(RotationError, match=r"^the two axes are zero or parallel$"):
            Rot6d().decode(axes)


def test_unknown_code_names_the_valid_ones():
    with pytest.raises(UnknownNameError, match=r"^Unknown rotation 'euler'\. Valid: quat, rot6d, rot6d_rows\.$"):
        make_rotation("euler", np.eye(3))
