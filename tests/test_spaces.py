import json

import numpy as np
import pytest
from chains import chain_arm, write_chain
from scipy.spatial.transform import Rotation

from er_il import ActionSpace, Arm, ArmAngleFrames, Status, from_spec, make_action_space
from er_il.spaces.pose import POSTURE_PULL
from er_il.spaces.registry import name_of
from er_il.spaces.round_trip import EXACT, SINGULAR, UNEXPLAINED, RoundTrip, round_trips
from er_il.support.errors import ArmError, ErIlError, ShapeError, SpecError, UnknownNameError

PANDA = Arm.preset("panda")


def assert_returns_joints(space: ActionSpace, trips: list[RoundTrip], share: float) -> None:
    exact = [trip for trip in trips if trip.exact]
    assert len(exact) / len(trips) >= share
    assert all(trip.status is Status.OK for trip in exact)
    assert all(trip.cause != UNEXPLAINED for trip in trips)
    for trip in trips:
        if trip.status is Status.OK:
            assert max(space.kinematics.pose_error(space.fk(trip.q), trip.found)) < 1e-3


# ---------------------------------------------------------------- the leading property


def test_joint_space_returns_the_joints_always():
    for trip in round_trips(make_action_space("joint", PANDA).arm_space, 100):
        np.testing.assert_array_equal(trip.found, trip.q)
        assert trip.status is Status.OK


@pytest.mark.parametrize("rotation", ["quat", "rot6d"])
@pytest.mark.parametrize(
    ("kind", "seed_error", "share"),
    [("erj", 0.1, 0.98), ("era", 0.1, 0.98), ("era@stereo", 0.1, 0.98), ("erj", 0.03, 0.99)],
)
def test_er_spaces_return_the_joints(kind, seed_error, share, rotation):
    space = make_action_space(kind, PANDA, rotation=rotation)
    assert_returns_joints(space, round_trips(space.arm_space, 500, seed_error=seed_error), share)


@pytest.mark.parametrize("kind", ["erj", "era"])
def test_er_spaces_return_the_joints_from_seeds_a_tenth_of_a_radian_away(kind):
    """Away by the distance, all joints together, where the test above has each joint off by as much."""
    space, rng = make_action_space(kind, PANDA), np.random.default_rng(0)
    exact = []
    for q in rng.uniform(PANDA.lower, PANDA.upper, (1000, PANDA.dof)):
        way = rng.normal(size=PANDA.dof)
        seed = np.clip(q + rng.uniform(0.0, 0.1) * way / np.linalg.norm(way), PANDA.lower, PANDA.upper)
        exact.append(np.abs(space.decode(space.encode(q), seed).q - q).max() <= EXACT)
    assert np.mean(exact) >= 0.99


@pytest.mark.parametrize("kind", ["erj", "era"])
def test_er_spaces_return_the_joints_wherever_the_arm_is_well_conditioned(kind):
    space = make_action_space(kind, PANDA)
    trips = [trip for trip in round_trips(space.arm_space, 400, rng_seed=1) if trip.conditioning >= SINGULAR]
    assert len(trips) > 100
    assert all(trip.exact for trip in trips)


def test_what_erj_misses_has_a_second_solution_nearer_the_seed():
    """So no decoder that knows only the action and the seed could have told: the share's ceiling."""
    space = make_action_space("erj", PANDA)
    trips = round_trips(space.arm_space, 1500, rng_seed=2)
    assert any(trip.ambiguous for trip in trips)
    assert np.mean([trip.exact or trip.ambiguous for trip in trips]) >= 0.998


@pytest.mark.parametrize("posture", [None, PANDA.home])
def test_task_space_returns_the_pose_and_not_the_joints(posture):
    space = make_action_space("task", PANDA, posture=posture)
    rng = np.random.default_rng(0)
    off = []
    for _ in range(150):
        q = PANDA.home + rng.uniform(-0.5, 0.5, 7)
        decoded = space.decode(space.encode(q), q + rng.uniform(-0.1, 0.1, 7))
        if decoded.status is Status.OK:
            assert max(space.kinematics.pose_error(space.fk(q), decoded.q)) < 1e-6
            off.append(np.abs(decoded.q - q).max())
    assert len(off) >= 148
    assert np.median(off) > 0.01


def test_erj_on_continuous_joints(tmp_path):
    arm = Arm.from_urdf(write_chain(tmp_path / "endless.urdf", 7, kind="continuous"), ee_frame="tool")
    space = make_action_space("erj", arm)
    assert_returns_joints(space, round_trips(space.arm_space, 100, seed_error=0.05), 0.93)
    beyond = np.r_[6.0, np.full(6, 0.4)]  # past half a turn: the seed's turn is kept
    np.testing.assert_allclose(space.decode(space.encode(beyond), beyond + 0.02).q, beyond, atol=EXACT)


@pytest.mark.parametrize("joints", [7, 8, 9])
def test_erj_on_random_chains(tmp_path, joints):
    for seed in range(3):
        space = make_action_space("erj", chain_arm(tmp_path, joints, seed))
        assert space.dim == 3 + 4 + (joints - 6) + 1
        assert_returns_joints(space, round_trips(space.arm_space, 150, rng_seed=seed), 0.96)


def test_era_on_random_chains(tmp_path):
    for seed in range(3):
        urdf = write_chain(tmp_path / f"chain{seed}.urdf", 7, seed)
        frames = ArmAngleFrames(shoulder="l2", elbow="l4", wrist="l6")
        space = make_action_space("era", Arm.from_urdf(urdf, ee_frame="tool", angle_frames=frames))
        assert_returns_joints(space, round_trips(space.arm_space, 150, rng_seed=seed), 0.96)


# ---------------------------------------------------------------- shapes, names, batches


def test_dimensions_are_those_of_the_paper():
    dims = {kind: make_action_space(kind, PANDA).dim for kind in ("joint", "task", "erj", "era")}
    assert dims == {"joint": 8, "task": 8, "erj": 9, "era": 9}
    names = make_action_space("erj", PANDA, rotation="rot6d").names
    assert names[:3] == ("ee.x", "ee.y", "ee.z") and names[-2:] == ("panda_joint1.pos", "gripper")
    assert len(names) == 11


@pytest.mark.parametrize("kind", ["joint", "task", "erj", "era"])
def test_a_trajectory_encodes_like_its_rows_up_to_the_turn(kind):
    space = make_action_space(kind, PANDA)
    q = PANDA.home + np.linspace(0, 0.3, 6)[:, None] * np.ones(7)
    batch = space.encode(q, np.linspace(0, 1, 6))
    assert batch.shape == (6, space.dim)
    np.testing.assert_allclose(batch, [space.encode(row, g) for row, g in zip(q, np.linspace(0, 1, 6), strict=True)])


def test_wrong_shapes_are_refused_with_what_was_expected():
    space = make_action_space("joint", PANDA)
    with pytest.raises(ShapeError, match=r"^Joint angles has shape \(6,\), expected \(7,\) or \(N, 7\)\.$"):
        space.encode(np.zeros(6))
    with pytest.raises(ShapeError, match=r"^A joint action has shape \(9,\), expected \(8,\): panda_joint1\.pos, "):
        space.decode(np.zeros(9), PANDA.home)
    with pytest.raises(ShapeError, match=r"^The seed has shape \(8,\), expected \(7,\)\.$"):
        space.decode(np.zeros(8), np.zeros(8))


def test_unknown_space_names_the_valid_ones():
    with pytest.raises(
        UnknownNameError,
        match=r"^Unknown action space 'ik'\. Valid: joint, task, erj, era, era@stereo, erx, rel_joint, .*delta_",
    ):
        make_action_space("ik", PANDA)


# ---------------------------------------------------------------- what policies get wrong


@pytest.mark.parametrize("kind", ["joint", "task", "erj", "era"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_invalid_and_keeps_the_arm(kind, value):
    space = make_action_space(kind, PANDA)
    for index in range(space.dim):
        action = space.encode(PANDA.home + 0.2, 0.5)
        action[index] = value
        decoded = space.decode(action, PANDA.home)
        assert decoded.status is Status.INVALID
        np.testing.assert_array_equal(decoded.q, PANDA.home)
        assert 0.0 <= decoded.gripper <= 1.0


@pytest.mark.parametrize(("rotation", "numbers"), [("quat", slice(3, 7)), ("rot6d", slice(3, 9))])
def test_a_zero_rotation_is_invalid(rotation, numbers):
    space = make_action_space("erj", PANDA, rotation=rotation)
    action = space.encode(PANDA.home)
    action[numbers] = 0.0
    assert space.decode(action, PANDA.home).status is Status.INVALID


def test_quaternion_twins_and_lengths_decode_alike():
    space = make_action_space("erj", PANDA)
    action = space.encode(PANDA.home + 0.1)
    expected = space.decode(action, PANDA.home).q
    for factor in (-1.0, 3.0, -0.01):
        twin = action.copy()
        twin[3:7] *= factor
        np.testing.assert_allclose(space.decode(twin, PANDA.home).q, expected, atol=1e-6)


def test_the_gripper_is_clipped():
    space = make_action_space("joint", PANDA)
    assert [space.decode(space.encode(PANDA.home, g), PANDA.home).gripper for g in (-2.0, 0.3, 4.0)] == [0.0, 0.3, 1.0]


@pytest.mark.parametrize("kind", ["task", "erj", "era"])
def test_an_unreachable_pose_is_said_and_stays_within_limits(kind):
    space = make_action_space(kind, PANDA)
    action = space.encode(PANDA.home)
    action[:3] = [1.5, 0.0, 0.3]
    decoded = space.decode(action, PANDA.home)
    assert decoded.status is Status.UNREACHABLE
    assert np.all(decoded.q >= PANDA.lower) and np.all(decoded.q <= PANDA.upper)
    assert decoded.pos_err > 0.1


def test_joint_commands_beyond_the_limits_are_clipped_and_said():
    space = make_action_space("joint", PANDA)
    action = space.encode(PANDA.home)
    action[3] = 5.0
    decoded = space.decode(action, PANDA.home)
    assert decoded.status is Status.LIMIT and decoded.q[3] == PANDA.upper[3]
    erj = make_action_space("erj", PANDA)
    action = erj.encode(PANDA.home)
    action[7] = -9.0
    assert erj.decode(action, PANDA.home).status is Status.LIMIT


@pytest.mark.parametrize("kind", ["task", "erj", "era"])
def test_a_smooth_path_is_followed_without_a_jump(kind):
    """Twenty circles of the elbow's base joint and the hand: the branch must not flip."""
    space = make_action_space(kind, PANDA)
    time = np.linspace(0, 2 * np.pi, 300)[:, None]
    q = PANDA.home + 0.5 * np.sin(time * np.array([1, 1, 2, 1, 2, 1, 3]) + np.arange(7))
    at = q[0]
    largest = 0.0
    for action in space.encode(q):
        decoded = space.decode(action, at)
        assert decoded.status is Status.OK
        largest = max(largest, float(np.abs(decoded.q - at).max()))
        at = decoded.q
    assert largest < 1.5 * np.abs(np.diff(q, axis=0)).max() + 1e-3
    if kind != "task":
        np.testing.assert_allclose(at, q[-1], atol=EXACT)


def test_seeds_beyond_the_limits_are_pulled_in():
    space = make_action_space("erj", PANDA)
    decoded = space.decode(space.encode(PANDA.home), PANDA.home + np.array([0, 0, 0, 0, 0, 9.0, 0]))
    assert np.all(decoded.q <= PANDA.upper)


# ---------------------------------------------------------------- arms without redundancy, specs


@pytest.mark.parametrize("kind", ["erj", "era"])
def test_arms_without_redundancy_get_joint_and_task_only(tmp_path, kind):
    arm = chain_arm(tmp_path, 6)
    with pytest.raises(ArmError, match=r"^chain6 has 6 joints and so no redundancy: .* Use joint or task"):
        make_action_space(kind, arm)
    assert make_action_space("task", arm).dim == 8
    assert make_action_space("joint", arm).dim == 7


@pytest.mark.parametrize("kind", ["joint", "task", "erj", "era"])
@pytest.mark.parametrize("rotation", ["quat", "rot6d"])
def test_specs_survive_json(kind, rotation):
    space = make_action_space(kind, PANDA, rotation=rotation)
    again = from_spec(json.loads(json.dumps(space.spec())))
    assert again.spec() == space.spec()
    assert again.names == space.names
    q = PANDA.home + 0.1
    np.testing.assert_allclose(again.encode(q), space.encode(q))


def test_a_spec_keeps_the_hemisphere_it_was_made_with():
    space = make_action_space("task", PANDA)
    spec = json.loads(json.dumps(space.spec()))
    spec["hemisphere"] = [-value for value in spec["hemisphere"]]
    np.testing.assert_allclose(from_spec(spec).encode(PANDA.home)[3:7], -space.encode(PANDA.home)[3:7])


def test_specs_of_other_arms_and_broken_specs_are_refused(tmp_path):
    spec = make_action_space("erj", PANDA).spec()
    for change, message in [
        ({"version": 7}, r"^Action spec has version 7; this er_il reads 1\.$"),
        ({"arm": {**spec["arm"], "redundant": ["panda_joint9"]}}, "^The action spec is for redundant .*panda_joint9"),
        ({"arm": {**spec["arm"], "fingerprint": "0"}}, "^The action spec is for fingerprint 0, but the arm 'panda'"),
        ({"arm": {"name": "panda"}}, "^Action spec has no .redundant."),
    ]:
        with pytest.raises(SpecError, match=message):
            from_spec({**spec, **change})
    with pytest.raises(SpecError, match=r"^Action spec has no 'space'"):
        from_spec({key: value for key, value in spec.items() if key != "space"})
    with pytest.raises(UnknownNameError, match=r"^Unknown action space 'era9'"):
        from_spec({**spec, "space": "era9"})
    with pytest.raises(SpecError, match=r"^The action spec is for joints"):
        from_spec(spec, chain_arm(tmp_path, 7))


def test_joint_order_is_part_of_the_arm(tmp_path):
    urdf = write_chain(tmp_path / "chain.urdf", 7)
    names = [f"j{i}" for i in range(1, 8)]
    straight = make_action_space("erj", Arm.from_urdf(urdf, ee_frame="tool", joints=names))
    turned = make_action_space("erj", Arm.from_urdf(urdf, ee_frame="tool", joints=names[::-1], redundant=["j1"]))
    q = np.linspace(-0.7, 0.7, 7)
    np.testing.assert_allclose(turned.encode(q[::-1]), straight.encode(q))
    with pytest.raises(SpecError, match=r"^The action spec is for joints"):
        from_spec(straight.spec(), turned.arm)


@pytest.mark.parametrize("kind", ["task", "erj", "era"])
@pytest.mark.parametrize("rotation", ["quat", "rot6d"])
def test_rotations_are_continuous_along_a_demo_through_half_a_turn(kind, rotation):
    space = make_action_space(kind, PANDA, rotation=rotation)
    q = np.tile(PANDA.home, (80, 1))
    q[:, 6] = np.linspace(PANDA.lower[6], PANDA.upper[6], 80)  # the hand turns by 332 degrees
    turned = Rotation.from_matrix(space.fk(PANDA.home)[:3, :3].T @ space.fk(q[0])[:3, :3]).magnitude()
    assert turned < np.pi < PANDA.home[6] - PANDA.lower[6]  # past half a turn from where the sign is chosen
    actions = space.encode(q)
    assert np.abs(np.diff(actions, axis=0)).max() < 0.1
    np.testing.assert_allclose([space.decode(a, row).q for a, row in zip(actions, q, strict=True)], q, atol=EXACT)


def test_posture_pulls_step_by_step_and_arrives():
    """The null space moves by no more than the declared pull a decode, and ends where the posture wants it."""
    pulled, nearest = (make_action_space("task", PANDA, posture=posture) for posture in (PANDA.home, None))
    q = np.array([1.25, -1.01, -0.32, -1.86, -1.18, 1.85, 1.44])
    action = pulled.encode(q)
    steps = []
    for _ in range(150):
        decoded = pulled.decode(action, q)
        assert decoded.status is Status.OK
        steps.append(np.max(np.abs(decoded.q - q)))
        q = decoded.q
    assert max(steps) < 2 * POSTURE_PULL
    assert steps[-1] < 1e-3
    assert np.linalg.norm(q - PANDA.home) < np.linalg.norm(nearest.decode(action, q).q - PANDA.home) + 1e-3
    assert abs(q[0]) < 0.2  # home's elbow points up


@pytest.mark.parametrize("joint", ["panda_joint3", "panda_joint5", "panda_joint7"])
def test_erj_commands_the_joint_that_its_name_says(joint: str) -> None:
    space = make_action_space(f"erj@{joint}", PANDA)
    assert space.names[-2:] == (f"{joint}.pos", "gripper")
    q = PANDA.home + 0.2
    encoded = space.encode(q, 1.0)
    assert encoded[-2] == pytest.approx(q[PANDA.joints.index(joint)])
    decoded = space.decode(encoded, seed=q + 0.05)
    assert decoded.q == pytest.approx(q, abs=1e-3)
    again = from_spec(space.spec())
    assert again.names == space.names
    assert name_of(again, PANDA) == f"erj@{joint}"
    assert name_of(make_action_space("erj", PANDA), PANDA) == "erj"
    assert make_action_space(f"erj@{joint}", PANDA).arm is space.arm  # its kinematics are built once


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("task@panda_joint1", "Unknown action space 'task@panda_joint1'"),
        ("erj@", "Unknown action space 'erj@'"),
        ("erj@panda_joint9", "panda_joint9 are not among panda_joint1"),
        ("erj@panda_joint1+panda_joint2", "commands 1 of them, not 2"),
    ],
)
def test_a_name_with_joints_that_cannot_be_is_refused(name: str, complaint: str) -> None:
    with pytest.raises(ErIlError, match=complaint):
        make_action_space(name, PANDA)
