import numpy as np
import pytest
from chains import chain_arm, write_chain
from scipy.spatial.transform import Rotation

from er_il import Arm, Status
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import Kinematics, kinematics_of
from er_il.support.errors import ShapeError, UnknownNameError

PANDA = Arm.preset("panda")
KINEMATICS = kinematics_of(PANDA)


def random_q(arm: Arm, rng: np.random.Generator, margin: float = 0.0) -> np.ndarray:
    return rng.uniform(arm.lower + margin, arm.upper - margin)


def test_the_panda_stands_where_its_maker_says():
    # Franka's data sheet: DH parameters 0.333, 0.316, 0.0825, 0.384, 0.088, flange 0.107; TCP 0.1034 beyond it.
    at_zero = KINEMATICS.fk(np.zeros(7))
    np.testing.assert_allclose(at_zero[:3, 3], [0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107 - 0.1034], atol=1e-3)
    np.testing.assert_allclose(at_zero[:3, 2], [0, 0, -1], atol=1e-9)


def test_batch_and_single_agree():
    rng = np.random.default_rng(0)
    q = np.array([random_q(PANDA, rng) for _ in range(5)])
    for frame in ("panda_hand_tcp", "panda_link4"):
        expected = [KINEMATICS.frame_pose(row, frame) for row in q]
        np.testing.assert_allclose(KINEMATICS.fk_batch(q, frame), expected)


def test_jacobian_is_the_derivative_in_the_base_frame(tmp_path):
    # A base frame that is turned and moved against the URDF's root.
    arm = Arm.from_urdf(write_chain(tmp_path / "chain.urdf", 8), base_frame="l1", ee_frame="tool")
    kinematics = kinematics_of(arm)
    q, h = np.full(7, 0.3), 1e-6
    jacobian = kinematics.jacobian(q)
    for i, direction in enumerate(np.eye(7)):
        ahead, behind = kinematics.fk(q + h * direction), kinematics.fk(q - h * direction)
        np.testing.assert_allclose(jacobian[:3, i], (ahead[:3, 3] - behind[:3, 3]) / (2 * h), atol=1e-7)
        turn = Rotation.from_matrix(ahead[:3, :3] @ behind[:3, :3].T).as_rotvec() / (2 * h)
        np.testing.assert_allclose(jacobian[3:, i], turn, atol=1e-7)


def test_joint_order_of_the_file_does_not_matter(tmp_path):
    names = [f"j{i}" for i in range(1, 8)]
    straight = Arm.from_urdf(write_chain(tmp_path / "a.urdf", 7), ee_frame="tool", joints=names)
    shuffled_file = write_chain(tmp_path / "b.urdf", 7, order=[3, 6, 0, 2, 5, 1, 4])
    shuffled = Arm.from_urdf(shuffled_file, ee_frame="tool", joints=names)
    q = np.linspace(-0.9, 0.9, 7)
    np.testing.assert_allclose(kinematics_of(straight).fk(q), kinematics_of(shuffled).fk(q))
    reversed_arm = Arm.from_urdf(shuffled_file, ee_frame="tool", joints=names[::-1], redundant=["j1"])
    kinematics = kinematics_of(reversed_arm)
    np.testing.assert_allclose(kinematics.fk(q[::-1]), kinematics_of(straight).fk(q))
    np.testing.assert_allclose(kinematics.jacobian(q[::-1])[:, ::-1], kinematics_of(straight).jacobian(q))
    ik = kinematics.solve(kinematics.fk(q[::-1]), q[::-1] + 0.02, JointAngle(reversed_arm, ("j1",)), [q[0]])
    assert ik.status is Status.OK
    np.testing.assert_allclose(ik.q, q[::-1], atol=1e-4)


def test_solution_reaches_the_pose_within_tolerance_and_limits():
    rng = np.random.default_rng(1)
    for _ in range(50):
        q = random_q(PANDA, rng)
        target = KINEMATICS.fk(q)
        ik = KINEMATICS.solve(target, q + rng.uniform(-0.2, 0.2, 7))
        pos_err, rot_err = KINEMATICS.pose_error(target, ik.q)
        assert (pos_err <= 1e-4 and rot_err <= 1e-3) == (ik.status is Status.OK)
        assert np.isclose(pos_err, ik.pos_err) and np.isclose(rot_err, ik.rot_err)
        assert np.all(ik.q >= PANDA.lower) and np.all(ik.q <= PANDA.upper)


def test_held_joints_keep_their_angle():
    q = PANDA.home + 0.1
    ik = KINEMATICS.solve(KINEMATICS.fk(q), PANDA.home, JointAngle(PANDA, ("panda_joint3",)), [q[2]])
    assert ik.status is Status.OK
    assert ik.q[2] == q[2]
    np.testing.assert_allclose(ik.q, q, atol=1e-4)


def test_a_held_joint_beyond_its_limit_is_clipped_and_reported():
    ik = KINEMATICS.solve(KINEMATICS.fk(PANDA.home), PANDA.home, JointAngle(PANDA, ("panda_joint1",)), [9.0])
    assert ik.status is Status.LIMIT
    assert ik.q[0] == PANDA.upper[0]


def test_posture_moves_the_null_space_and_costs_no_accuracy():
    rng = np.random.default_rng(2)
    nearer = 0
    for _ in range(30):
        q = PANDA.home + rng.uniform(-0.4, 0.4, 7)
        target = KINEMATICS.fk(q)
        plain = KINEMATICS.solve(target, q)
        pulled = KINEMATICS.solve(target, q, posture=PANDA.home)
        assert pulled.status is Status.OK
        assert max(pulled.pos_err, pulled.rot_err) < 1e-7  # as exact as ERJ's decode
        nearer += np.linalg.norm(pulled.q - PANDA.home) < np.linalg.norm(plain.q - PANDA.home)
    assert nearer == 30


def test_posture_gives_one_answer_whatever_the_seed():
    rng = np.random.default_rng(3)
    target = KINEMATICS.fk(PANDA.home + 0.1)
    answers = [KINEMATICS.solve(target, PANDA.home + rng.uniform(-0.3, 0.3, 7), posture=PANDA.home).q for _ in range(8)]
    assert np.ptp(answers, axis=0).max() < 0.02


def test_out_of_reach_is_said_and_the_arm_stretches_towards_it():
    target = KINEMATICS.fk(PANDA.home)
    target[:3, 3] = [2.0, 0.0, 0.5]
    ik = KINEMATICS.solve(target, PANDA.home)
    assert ik.status is Status.UNREACHABLE
    assert ik.pos_err < np.linalg.norm(target[:3, 3] - KINEMATICS.fk(PANDA.home)[:3, 3])
    assert np.all(np.isfinite(ik.q)) and np.all(ik.q >= PANDA.lower) and np.all(ik.q <= PANDA.upper)


def test_a_stretched_arm_stays_finite():
    # Out of reach by little, at the boundary where the Jacobian loses rank.
    stretched = np.array([0.0, 0.6, 0.0, -0.07, 0.0, 1.6, 0.8])
    target = KINEMATICS.fk(stretched)
    target[:3, 3] += 0.05 * target[:3, 3] / np.linalg.norm(target[:3, 3])
    for redundancy in ((), (JointAngle(PANDA, ("panda_joint1",)), [0.0])):
        ik = KINEMATICS.solve(target, stretched, *redundancy)
        assert ik.status is Status.UNREACHABLE
        assert np.abs(ik.q - stretched).max() < 1.5
        assert ik.pos_err < 0.06


def test_a_limit_in_the_way_is_named():
    q = PANDA.home.copy()
    q[5] = PANDA.upper[5]
    beyond = q.copy()
    beyond[5] += 0.2
    ik = KINEMATICS.solve(KINEMATICS.fk(beyond), q, JointAngle(PANDA, ("panda_joint1",)), [0.0])
    assert ik.status is Status.LIMIT


def test_other_branch_is_taken_only_if_nearer():
    """Near a fold two solutions lie close together; the decode takes the one nearer the seed."""
    rng = np.random.default_rng(4)
    arm, checked, other = PANDA, 0, 0
    for _ in range(400):
        q = random_q(arm, rng)
        singular = np.linalg.svd(KINEMATICS.jacobian(q)[:, 1:], compute_uv=False)[-1]
        if singular > 0.01:
            continue
        seed = np.clip(q + rng.uniform(-0.1, 0.1, 7), arm.lower, arm.upper)
        seed[0] = q[0]
        ik = KINEMATICS.solve(KINEMATICS.fk(q), seed, JointAngle(PANDA, ("panda_joint1",)), [q[0]])
        checked += 1
        other += np.abs(ik.q - q).max() > 0.01
        assert ik.status is Status.OK
        assert np.linalg.norm(ik.q - seed) <= np.linalg.norm(q - seed) + 2e-3
    assert checked > 60
    assert other >= 3


def test_wrong_shapes_and_names_are_refused_with_what_was_expected():
    with pytest.raises(ShapeError, match=r"^Joint angles has shape \(6,\), expected \(7,\)\.$"):
        KINEMATICS.fk(np.zeros(6))
    with pytest.raises(ShapeError, match=r"^Joint angles has shape \(7,\), expected \(N, 7\)\.$"):
        KINEMATICS.fk_batch(np.zeros(7))
    with pytest.raises(UnknownNameError, match=r"^Unknown frame 'elbow'\. Valid: .*panda_link4"):
        KINEMATICS.frame_pose(np.zeros(7), "elbow")
    with pytest.raises(UnknownNameError, match=r"^Unknown joint 'j9'\. Valid: panda_joint1, "):
        JointAngle(PANDA, ("j9",))
    with pytest.raises(ShapeError, match=r"shape \(2,\), expected \(1,\): panda_joint1\.pos"):
        KINEMATICS.solve(np.eye(4), PANDA.home, JointAngle(PANDA, ("panda_joint1",)), [0.0, 0.0])


@pytest.mark.parametrize("joints", [6, 7, 8, 9])
def test_random_chains_are_solved(tmp_path, joints):
    arm = chain_arm(tmp_path, joints, seed=joints)
    kinematics, rng = kinematics_of(arm), np.random.default_rng(joints)
    solved = 0
    for _ in range(40):
        q = random_q(arm, rng, 0.2)
        solved += kinematics.solve(kinematics.fk(q), q + rng.uniform(-0.1, 0.1, joints)).status is Status.OK
    assert solved >= 39


@pytest.mark.parametrize("redundancy", [(), (JointAngle(PANDA, ("panda_joint1",)), [0.0]), (ArmAngle(PANDA), [0.0])])
def test_what_is_farther_than_the_arm_is_long_is_unreachable_whatever_the_limits(redundancy):
    """Stretched towards it the Panda's elbow is at its limit, but that limit is not the reason."""
    for position in ([2.0, 0.0, 0.5], [0.0, -1.5, 0.3], [0.3, 0.0, 1.6]):
        target = KINEMATICS.fk(PANDA.home)
        target[:3, 3] = position
        assert KINEMATICS.solve(target, PANDA.home, *redundancy).status is Status.UNREACHABLE


def test_nothing_is_farther_than_the_arm_is_long():
    rng = np.random.default_rng(5)
    for name in ("panda", "panda8", "xarm7"):
        arm = Arm.preset(name)
        kinematics = kinematics_of(arm)
        assert all(kinematics.within_reach(kinematics.fk(random_q(arm, rng))[:3, 3]) for _ in range(200))
    assert not KINEMATICS.within_reach(np.array([1.2, 0.0, 0.3]))


@pytest.mark.parametrize(
    ("up", "held", "status"),
    [(0.5, [6], Status.UNREACHABLE), (-0.9, [1, 6], Status.LIMIT)],  # overhead; into the table, which joint 2 limits
)
def test_a_limit_that_is_touched_but_not_in_the_way_is_not_named(up, held, status):
    q = PANDA.home.copy()
    q[6] = PANDA.upper[6]  # the hand's own turn
    target = KINEMATICS.fk(q)
    target[2, 3] += up  # nothing to do with the hand's turn
    ik = KINEMATICS.solve(target, q, JointAngle(PANDA, ("panda_joint1",)), [0.0])
    assert ik.status is status
    assert np.flatnonzero((ik.q - PANDA.lower < 1e-4) | (PANDA.upper - ik.q < 1e-4)).tolist() == held


def test_damping_costs_nothing_where_it_is_easy_and_ends_nearer_to_what_cannot_be_met():
    undamped = kinematics_of(PANDA, damped=False)
    easy = PANDA.home + 0.1
    for kinematics in (KINEMATICS, undamped):
        ik = kinematics.solve(kinematics.fk(easy), PANDA.home, JointAngle(PANDA, ("panda_joint1",)), [0.1])
        np.testing.assert_allclose(ik.q, easy, atol=1e-4)
    rng = np.random.default_rng(6)
    missed, met = {KINEMATICS: 0.0, undamped: 0.0}, {KINEMATICS: 0, undamped: 0}
    for _ in range(60):
        q = random_q(PANDA, rng, 0.05)
        target = KINEMATICS.fk(q)
        target[:3, 3] += rng.normal(scale=0.05, size=3)
        for kinematics in missed:
            ik = kinematics.solve(target, q, JointAngle(PANDA, ("panda_joint1",)), [q[0]])
            met[kinematics] += ik.status is Status.OK
            missed[kinematics] += (ik.pos_err + ik.rot_err) * (ik.status is not Status.OK)
    assert 50 >= met[KINEMATICS] >= met[undamped] >= 30
    assert missed[KINEMATICS] < 0.9 * missed[undamped]


def test_no_bit_of_a_solution_depends_on_where_in_memory_its_program_lies():
    rng = np.random.default_rng(0)
    redundancies = JointAngle(PANDA, PANDA.redundant), ArmAngle(PANDA)
    starts = PANDA.within_limits(PANDA.home + rng.uniform(-0.5, 0.5, (100, 7)))
    ends = PANDA.within_limits(starts + rng.uniform(-0.06, 0.06, (100, 7)))
    goals = [(KINEMATICS.fk(end), start, end) for start, end in zip(starts, ends, strict=True)]
    found = set()
    for _ in range(6):
        litter = [bytearray(size) for size in rng.integers(20, 400, 20_000)]
        del litter[::3]  # gaps, into which the next program's parts fall
        kinematics, bits = Kinematics(PANDA), b""
        for T, start, end in goals:
            for redundancy in redundancies:
                bits += kinematics.solve(T, start, redundancy, redundancy.along(end[None]).ravel()).q.tobytes()
        bits += b"".join(kinematics.solve(T, start, posture=PANDA.home).q.tobytes() for T, start, _ in goals[:20])
        found.add(bits)
    assert len(found) == 1
