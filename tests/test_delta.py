import json

import numpy as np
import pytest

from er_il import ActionSpace, Arm, Status, from_spec, make_action_space
from er_il.spaces.delta import DeltaBounds, DeltaSpace
from er_il.support.errors import BoundsError, ShapeError, UnknownNameError

PANDA = Arm.preset("panda")
KINDS = ["joint", "task", "erj", "era"]


def demo(steps: int = 200) -> np.ndarray:
    """A smooth path through the workspace, at a fraction of full speed."""
    time = np.linspace(0, 2 * np.pi, steps)[:, None]
    return PANDA.home + 0.25 * np.sin(time * np.array([1, 1, 2, 1, 2, 1, 2]) + np.arange(7)) * np.ones(7)


def delta(kind: str, **kwargs) -> ActionSpace:
    space = make_action_space(f"delta_{kind}", PANDA, **kwargs)
    assert isinstance(space.arm_space, DeltaSpace)
    return space


def limits(space: ActionSpace) -> np.ndarray:
    assert isinstance(space.arm_space, DeltaSpace)
    return space.arm_space.limits


def integrate(space: ActionSpace, actions: np.ndarray, start: np.ndarray, lag: float = 0.0) -> np.ndarray:
    """Decode each action from the last command; the measured joints trail it by up to ``lag``."""
    rng, path = np.random.default_rng(0), [start]
    for action in actions:
        decoded = space.decode(action, path[-1] + rng.uniform(-lag, lag, 7), current=path[-1])
        assert decoded.status is Status.OK
        path.append(decoded.q)
    return np.array(path)


@pytest.mark.parametrize("kind", ["joint", "erj", "era", "era@stereo"])
def test_integrating_a_demos_deltas_returns_to_its_joints(kind):
    q = demo()
    space = delta(kind)
    path = integrate(space, space.encode(q[1:], start=q[0]), q[0], lag=0.02)
    drift = np.abs(path - q).max(axis=1)
    assert drift[-1] < 1e-4  # [rad] after 200 steps


def test_integrating_a_demos_deltas_in_task_space_returns_to_its_poses():
    q = demo()
    space = delta("task")
    path = integrate(space, space.encode(q[1:], start=q[0]), q[0])
    for reached, wanted in zip(path[::20], q[::20], strict=True):
        assert max(space.kinematics.pose_error(space.fk(wanted), reached)) < 1e-4
    assert np.abs(path[-1] - q[-1]).max() > 0.01  # the elbow is free, as in the absolute space


@pytest.mark.parametrize("kind", KINDS)
def test_first_delta_is_zero_without_a_start_and_counts_from_it_with_one(kind):
    q, space = demo()[:5], delta(kind)
    alone = space.encode(q, 0.5)
    assert alone.shape == (5, space.dim)
    np.testing.assert_array_equal(alone[0, :-1], 0.0)
    np.testing.assert_allclose(space.encode(q[1:], 0.5, start=q[0]), alone[1:], atol=1e-12)
    np.testing.assert_allclose(space.encode(q[1], 0.5, start=q[0]), alone[1], atol=1e-12)
    np.testing.assert_array_equal(alone[:, -1], 0.5)


@pytest.mark.parametrize("kind", KINDS)
def test_a_zero_delta_keeps_the_command_and_not_the_measured_joints(kind):
    space = delta(kind)
    decoded = space.decode(np.append(np.zeros(space.dim - 1), 0.3), PANDA.home + 0.03, current=PANDA.home)
    assert decoded.status is Status.OK and decoded.gripper == 0.3
    if kind != "task":
        np.testing.assert_allclose(decoded.q, PANDA.home, atol=1e-6)
    assert max(space.kinematics.pose_error(space.fk(PANDA.home), decoded.q)) < 1e-6


def test_the_pose_changes_along_the_base_frames_axes():
    space = delta("erj")
    before = space.fk(PANDA.home)
    action = np.zeros(space.dim)
    action[:6] = [0.02, -0.01, 0.03, 0.0, 0.0, 0.2]
    after = space.fk(space.decode(action, PANDA.home).q)
    np.testing.assert_allclose(after[:3, 3] - before[:3, 3], action[:3], atol=1e-6)
    c, s = np.cos(0.2), np.sin(0.2)
    np.testing.assert_allclose(after[:3, :3] @ before[:3, :3].T, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-6)


@pytest.mark.parametrize("kind", ["task", "erj", "era"])
def test_rotations_stay_small_where_quaternions_would_flip(kind):
    q = np.tile(PANDA.home, (120, 1))
    q[:, 6] = np.linspace(PANDA.lower[6], PANDA.upper[6], 120)  # the hand turns by 332 degrees
    changes = delta(kind).encode(q)[1:, 3:6]
    np.testing.assert_allclose(np.linalg.norm(changes, axis=1), np.diff(q[:, 6]), atol=1e-9)


def test_the_arm_angles_change_has_no_wrap():
    space = delta("era")
    changes = space.encode(demo())[:, 6]
    assert np.abs(changes).max() < 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_what_exceeds_the_bounds_is_clipped_and_said(kind):
    space = delta(kind, bounds=DeltaBounds(position=0.01, rotation=0.02, angle=0.03))
    action = np.zeros(space.dim)
    action[0] = 0.5
    decoded = space.decode(action, PANDA.home)
    assert decoded.status is Status.LIMIT
    action[0] = limits(space)[0]
    at_bound = space.decode(action, PANDA.home)
    assert at_bound.status is Status.OK
    np.testing.assert_allclose(decoded.q, at_bound.q)
    assert space.decode(action.astype(np.float32), PANDA.home).status is Status.OK


def test_encoding_what_the_bounds_forbid_is_refused():
    space = delta("joint", bounds=DeltaBounds(angle=0.1))
    q = np.array([PANDA.home, PANDA.home + 0.05, PANDA.home + 0.25])
    with pytest.raises(
        BoundsError, match=r"^Step 2 changes panda_joint1\.delta by 0\.2; the declared bound is 0\.1\.$"
    ):
        space.encode(q)


@pytest.mark.parametrize("kind", KINDS)
def test_specs_of_deltas_survive_json(kind):
    space = delta(kind, bounds=DeltaBounds(0.02, 0.1, 0.05), rotation="rot6d")
    again = from_spec(json.loads(json.dumps(space.spec())))
    assert again.spec() == space.spec()
    np.testing.assert_array_equal(limits(again), limits(space))
    assert again.names == space.names
    assert space.spec()["space"] == f"delta_{kind}"


def test_dimensions_and_names():
    assert delta("erj").names == (
        *("ee.dx", "ee.dy", "ee.dz", "ee.drx", "ee.dry", "ee.drz"),
        *("panda_joint1.delta", "gripper"),
    )
    assert {kind: delta(kind).dim for kind in KINDS} == {"joint": 8, "task": 7, "erj": 8, "era": 8}


def test_wrong_input_is_refused():
    space = delta("erj")
    with pytest.raises(ShapeError, match=r"^The current command has shape \(6,\), expected \(7,\)\.$"):
        space.decode(np.zeros(8), PANDA.home, current=np.zeros(6))
    with pytest.raises(ShapeError, match=r"^The start has shape \(8,\), expected \(7,\)\.$"):
        space.encode(demo(), start=np.zeros(8))
    with pytest.raises(UnknownNameError, match=r"^Unknown action space 'delta_ik'\. Valid: .*delta_erj"):
        make_action_space("delta_ik", PANDA)
    invalid = space.decode(np.full(8, np.nan), PANDA.home)
    assert invalid.status is Status.INVALID


def test_default_bounds_are_what_the_arm_does_in_a_period():
    for arm in map(Arm.preset, ("panda", "xarm7", "gen3")):
        space = make_action_space("delta_joint", arm)
        assert np.all(limits(space) <= arm.velocity.max() * 0.05 + 1e-3)
        q = arm.home + 0.99 * 0.05 * arm.velocity * np.array([1, -1, 1, 1, -1, 1, -1])
        np.testing.assert_allclose(space.encode(q, start=arm.home)[:-1], q - arm.home)  # at full speed, not refused
