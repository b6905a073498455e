"""ERX: linear coordinates of the joints, their decoders, their specification, and the choice of their weights."""

import json
from pathlib import Path

import numpy as np
import pytest
from arms import REDUNDANT
from chains import chain_arm
from scipy.optimize import nnls

from er_il import Arm, Status, from_spec, make_action_space
from er_il.datasets.joint_paths import JointPath
from er_il.experiments.studies.margins import study_margins
from er_il.kinematics.linear_coordinates import LinearCoordinates
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.self_motion import margins, self_motions
from er_il.kinematics.solver import kinematics_of
from er_il.report.margins import margins_figure
from er_il.spaces import margin
from er_il.spaces.demo_margins import margins_along, motion_measured
from er_il.spaces.layout import Layout
from er_il.spaces.margin import demonstrated_weights, home_weights
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import erx_name, make_arm_space, name_of
from er_il.spaces.round_trip import UNEXPLAINED, round_trips
from er_il.support.errors import ArmError, SpecError, UnknownNameError

PANDA, PANDA8 = Arm.preset("panda"), Arm.preset("panda8")
FIRST = tuple(np.eye(7)[0].tolist())


def erx(name: str, arm: Arm) -> PoseSpace:
    space = make_arm_space(name, arm)
    assert isinstance(space, PoseSpace)
    return space


def path(arm: Arm, reach: float, steps: int = 60) -> np.ndarray:
    """A smooth path around home, at a fraction of full speed."""
    time = np.linspace(0, 2 * np.pi, steps)[:, None]
    return arm.home + reach * np.sin(time * (1 + np.arange(arm.dof) % 2) + np.arange(arm.dof))


@pytest.mark.parametrize("name", ["panda", "panda8", "xarm7", "gen3", "iiwa14", "g1"])
def test_the_joints_come_back_or_the_reason_is_known(name: str) -> None:
    trips = round_trips(make_arm_space("erx", REDUNDANT[name]()), 150, rng_seed=5)
    assert np.mean([trip.exact for trip in trips]) >= 0.95
    assert not [trip for trip in trips if trip.cause == UNEXPLAINED]
    assert all(trip.status is Status.OK for trip in trips if trip.exact)


@pytest.mark.parametrize("arm", [PANDA, PANDA8], ids=lambda arm: arm.name)
def test_changes_of_the_coordinates_lead_along_a_path_also_carried(arm: Arm) -> None:
    q = path(arm, 0.2)
    for kind in ("delta_erx", "carried_erx"):
        space, found = make_action_space(kind, arm), [q[0]]
        for action in space.encode(q[1:], start=q[0]):
            found.append(space.decode(action, found[-1], current=found[-1]).q)
        assert np.abs(np.array(found) - q).max() < 1e-4


def test_a_joint_is_the_coordinate_of_a_row_of_the_identity() -> None:
    erj, own = make_arm_space("erj", PANDA), make_arm_space(erx_name((FIRST,)), PANDA)
    rng = np.random.default_rng(2)
    q = PANDA.home + rng.uniform(-0.6, 0.6, (40, 7))
    np.testing.assert_array_equal(own.encode(q), erj.encode(q))
    for each, seed in zip(q, q + rng.uniform(-0.05, 0.05, q.shape), strict=True):
        action = erj.encode(each)
        np.testing.assert_allclose(own.decode(action, seed).q, erj.decode(action, seed).q, atol=1e-6)
    space = erx(erx_name((FIRST,)), PANDA)
    assert space.redundancy is not None
    np.testing.assert_allclose(margins(space.redundancy, q), margins(JointAngle(PANDA, PANDA.joints[:1]), q))


def test_a_carried_coordinate_moves_the_hand_as_its_joints_do() -> None:
    space = make_action_space("carried_erx", PANDA)
    w = np.array(PANDA.weights[0])
    action = np.zeros(8)
    action[6] = 0.07
    np.testing.assert_allclose(space.decode(action, PANDA.home).q, PANDA.home + 0.07 * w, atol=1e-5)
    action[:3] = 0.02, -0.01, 0.03
    moved, carried = space.fk(space.decode(action, PANDA.home).q), space.fk(PANDA.home + 0.07 * w)
    np.testing.assert_allclose(moved[:3, 3], carried[:3, 3] + action[:3], atol=1e-5)
    np.testing.assert_allclose(moved[:3, :3], carried[:3, :3], atol=1e-4)
    # By the definition of the paper's text the hand stays where it was.
    still = make_action_space("delta_erx", PANDA)
    action[:3] = 0.0
    turned = still.decode(action, PANDA.home).q
    np.testing.assert_allclose(still.fk(turned), still.fk(PANDA.home), atol=1e-5)
    assert w @ (turned - PANDA.home) == pytest.approx(0.07, abs=1e-5)


@pytest.mark.parametrize("kind", ["erx", "delta_erx", "carried_erx"])
def test_a_specification_brings_the_weights_back(kind: str, tmp_path: Path) -> None:
    W = np.linalg.qr(np.random.default_rng(0).normal(size=(8, 2)))[0].T
    arms = [PANDA8.weighing(W.tolist()), chain_arm(tmp_path, 7, 3), PANDA]
    for arm in arms:
        space = make_arm_space(kind, arm)
        spec = json.loads(json.dumps(Layout.of_space(space).spec()))
        again = Layout.from_spec(spec)
        assert again.spec() == spec and ("xml" in spec["arm"]) == (arm.name == "chain7")
        q = arm.home + 0.1
        np.testing.assert_array_equal(again.parts[0].space.encode(q), space.encode(q))
    other = Arm.from_urdf(PANDA.urdf, ee_frame="panda_link8", joints=PANDA.joints, name="panda")
    for arm in (other, other.weighing([FIRST])):  # a preset by its name only
        assert "xml" in Layout.of_space(make_arm_space(kind, arm)).spec()["arm"]
    assert name_of(make_arm_space(kind, arms[0]), PANDA8) == f"{kind}@{erx_name(arms[0].weights)[4:]}"
    assert name_of(make_arm_space(kind, PANDA), PANDA) == kind
    named = make_arm_space(name_of(make_arm_space(kind, arms[0]), PANDA8), PANDA8)
    assert named.arm.weights == arms[0].weights


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"weights": [[1.0, 0.0]]}, "The weights of panda's linear coordinates are not 1 rows of 7 numbers"),
        ({"weights": [[2.0, 0, 0, 0, 0, 0, 0]]}, "are no orthonormal rows"),
        ({"weights": [[float("nan"), 0, 0, 0, 0, 0, 0]]}, "finite number"),
        ({"weights": [["a"] * 7]}, "The action spec is damaged"),
        ({"joints": list(PANDA.joints[::-1])}, "The action spec weighs panda_joint7, panda_joint6"),
    ],
)
def test_damaged_weights_are_refused_in_one_line(change: dict[str, object], complaint: str) -> None:
    spec = make_action_space("erx", PANDA).spec()
    spec["linear_coordinates"] = spec["linear_coordinates"] | change
    with pytest.raises(SpecError, match=complaint) as refused:
        from_spec(spec)
    assert "\n" not in str(refused.value)


def test_mistakes_in_a_name_are_told() -> None:
    for name in ("erx@", "erx@joint1", "erx@0.8:-0.6:x", "era@1:0", "carried_era"):
        with pytest.raises(UnknownNameError, match=r"erx@NUMBER:NUMBER|carried_erx"):
            make_action_space(name, PANDA)
    with pytest.raises(ArmError, match="not 1 rows of 7 numbers"):
        make_action_space("erx@1:0", PANDA)
    with pytest.raises(ArmError, match="not 2 rows of 8 numbers"):
        make_action_space(erx_name((FIRST,)), PANDA8)
    with pytest.raises(ArmError, match="no redundancy"):
        make_action_space("erx", Arm.from_urdf(PANDA.urdf, ee_frame="panda_link6", joints=PANDA.joints[:6]))


@pytest.mark.parametrize("name", ["panda", "gen3"])
def test_the_weights_of_a_preset_are_those_that_are_fitted_around_its_home(name: str) -> None:
    arm = Arm.preset(name)
    np.testing.assert_allclose(arm.weights, home_weights(arm), atol=2e-3)
    assert margins(LinearCoordinates(arm, arm.weights), arm.home[None])[0] > 0.97


def test_any_other_arm_gets_weights_of_its_own(tmp_path: Path) -> None:
    arm = chain_arm(tmp_path, 7, 1)
    space = erx("erx", arm)
    assert space.redundancy is not None and arm.weights == ()
    near = arm.home + np.random.default_rng(3).uniform(-0.8, 0.8, (300, 7))
    own = np.log(margins(space.redundancy, near)).mean()
    assert all(own > np.log(margins(JointAngle(arm, (joint,)), near) + 1e-9).mean() for joint in arm.joints)


def sweep(centre: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Unit vectors (50, 7) that change slowly, within a third of a right angle of a direction."""
    turns = np.cumsum(rng.normal(scale=0.02, size=(50, 7)), axis=0)
    found = centre + turns + 0.2 * rng.normal(size=7)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_the_fit_to_demonstrations_has_the_largest_margin(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    centre = np.array([0.6, 0.0, -0.4, 0.0, 0.5, 0.0, 0.48])
    normals = [sweep(centre, rng) for _ in range(6)]
    signs = [1.0, -1.0, 1.0, -1.0, -1.0, 1.0]  # of a self-motion mean nothing
    flipped = [sign * each * rng.choice([-1.0, 1.0], (50, 1)) for sign, each in zip(signs, normals, strict=True)]
    monkeypatch.setattr(margin, "self_motions", lambda arm, q: q[:, None])
    w = np.array(demonstrated_weights(PANDA, flipped)[0])
    every = np.concatenate(normals) * np.sign(centre @ w)
    seen = every @ w
    # The optimum is the point of the normals' convex hull nearest to 0: a sum, with positive shares, of the closest.
    active = every[seen < seen.min() + 5e-4]
    assert seen.min() > 0.5 and nnls(active.T, w)[1] < 0.02
    others = w + 0.1 * rng.normal(size=(500, 7))
    others /= np.linalg.norm(others, axis=1, keepdims=True)
    assert (others @ every.T).min(axis=1).max() <= seen.min() + 1e-3


def test_two_directions_have_the_margin_of_their_bisector(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(margin, "self_motions", lambda arm, q: q[:, None])
    a = 0.7
    demos = [np.array([[np.cos(a), np.sin(a), 0, 0, 0, 0, 0]]), -np.array([[np.cos(a), -np.sin(a), 0, 0, 0, 0, 0]])]
    np.testing.assert_allclose(demonstrated_weights(PANDA, demos), [FIRST], atol=1e-4)


@pytest.mark.parametrize("arm", [PANDA, PANDA8], ids=lambda arm: arm.name)
def test_fitted_coordinates_are_farther_from_folds_than_any_joint(arm: Arm) -> None:
    demos = [path(arm, 0.5), path(arm, 0.6)[::-1]]
    space = erx(erx_name(demonstrated_weights(arm, demos)), arm)
    fitted, given = margins_along(space, demos), margins_along(erx("erx", arm), demos)
    joints = margins_along(erx("erj", arm), demos)
    assert fitted.smallest > joints.smallest and fitted.smallest >= given.smallest - 1e-3
    assert (fitted.folds, fitted.flips, fitted.risk) == (0, 0.0, 0.0)
    assert 1.0 < fitted.condition_p50 <= fitted.condition_p95 < joints.condition_p95
    assert space.redundancy is not None
    seen = margins(space.redundancy, demos[fitted.demo])
    assert seen[fitted.step] == seen.min() == fitted.smallest


def test_a_study_tells_the_demonstrations_from_the_arm_whatever_their_names() -> None:
    q = path(PANDA, 0.3, 12)
    report = study_margins(PANDA, {"erx": [JointPath(7, q, q)]}, 1, lambda done, total: None)
    rows = {row["space"]: row for row in json.loads(json.dumps(report))["margins"]}
    assert rows["erx (fitted)"]["smallest"] >= rows["erx"]["smallest"] > rows["panda_joint4"]["smallest"]
    assert {row["episode"] for row in rows.values()} == {7}
    own, fitted = report["coordinates"]
    assert (own["demos"], fitted["demos"]) == (None, "erx")
    assert (
        erx_name(own["weights"]) == rows["erx"]["name"] and erx_name(fitted["weights"]) == rows["erx (fitted)"]["name"]
    )
    assert report["notes"][0].startswith("Along erx the margin of ERX fitted to it is at least ")
    assert [note.split(":")[0] for note in report["notes"][1:]] == ["Weights of the arm", "Weights fitted to erx"]
    assert len(margins_figure(report).axes) == 2


@pytest.mark.parametrize("name", ["panda", "panda8"])
def test_margins_are_those_of_the_self_motion(name: str) -> None:
    arm = Arm.preset(name)
    q = arm.home + np.random.default_rng(1).uniform(-0.7, 0.7, (50, arm.dof))
    N = self_motions(arm, q)
    np.testing.assert_allclose(kinematics_of(arm).jacobians(q) @ N.transpose(0, 2, 1), 0.0, atol=1e-12)
    W = np.array(arm.weights)
    expected = [np.linalg.svd(W @ each.T, compute_uv=False)[-1] for each in N]
    np.testing.assert_allclose(margins(LinearCoordinates(arm, arm.weights), q), expected, atol=1e-3)
    era = erx("era", PANDA).redundancy
    assert era is not None
    assert np.all((margins(era, q[:, -7:]) >= 0.0) & (margins(era, q[:, -7:]) <= 1.0))


def test_what_a_coordinate_measures_is_how_the_arm_moves() -> None:
    told, small = motion_measured(PANDA, PANDA.weights), 1e-4
    moved = PANDA.home + small * np.array(told["joints"][0])
    kinematics = kinematics_of(PANDA)
    np.testing.assert_allclose(kinematics.fk(moved), kinematics.fk(PANDA.home), atol=1e-7)
    assert np.array(PANDA.weights[0]) @ (moved - PANDA.home) == pytest.approx(small)
    before, after = erx("era", PANDA).encode(PANDA.home)[-1], erx("era", PANDA).encode(moved)[-1]
    assert (after - before) / small == pytest.approx(told["elbow"][0], rel=1e-3)
