"""Properties of arms, spaces, layouts and specifications, over robots that hypothesis draws."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from chains import write_chain
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from er_il import Arm, Status
from er_il.spaces.base import ArmSpace
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import UNITS, Motors
from er_il.spaces.registry import arm_space_from_spec, make_arm_space

EXACT = 2e-4  # [rad] or [m]
NEAR_FOLD = 0.05  # conditioning below which a second solution may be nearer the seed

few = settings(max_examples=60, derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
kinds = st.sampled_from(["joint", "task", "erj", "delta_joint", "delta_erj", "carried_erj", "era"])
seeds = st.integers(0, 2**32 - 1)


@st.composite
def arms(draw: st.DrawFn) -> Arm:
    """A random chain of seven joints, or of eight, in any order in its file, with one of its joints commanded."""
    dof, seed = draw(st.integers(7, 8)), draw(st.integers(0, 10_000))
    limit = draw(st.floats(1.5, 3.0))
    with TemporaryDirectory() as folder:
        path = write_chain(
            Path(folder) / "arm.urdf",
            dof,
            seed,
            limits=(-limit, limit),
            velocity=draw(st.floats(0.5, 4.0)),
            order=draw(st.permutations(range(dof))),
        )
        joints = [f"j{i + 1}" for i in range(dof)]
        redundant = draw(st.sampled_from([joints[:2], joints[2:4]])) if dof == 8 else [draw(st.sampled_from(joints))]
        arm = Arm.from_urdf(path, ee_frame="tool", redundant=redundant)
        arm.fingerprint  # noqa: B018  the file is gone later
        make_arm_space("erj", arm).fk(arm.home)
        return arm


def space_of(arm: Arm, kind: str, rotation: str = "quat") -> ArmSpace:
    """A space of an arm; ERJ where the arm has more redundancy than an arm angle."""
    return make_arm_space("erj" if kind == "era" and arm.redundancy > 1 else kind, arm, rotation=rotation)


def postures(arm: Arm, seed: int, count: int) -> np.ndarray:
    """Joint angles (count, n) [rad] within four fifths of the limits."""
    return 0.8 * np.random.default_rng(seed).uniform(arm.lower, arm.upper, (count, arm.dof))


@few
@given(arms(), seeds)
def test_links_follow_the_joints_in_whatever_order_a_file_has_them(arm: Arm, seed: int) -> None:
    assert arm.joints == tuple(f"j{i + 1}" for i in range(arm.dof))
    q = postures(arm, seed, 1)[0]
    T_base_ee = make_arm_space("joint", arm).fk(q)
    R = T_base_ee[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(R) > 0
    # The last joint turns the tool about its own axis: the tool's origin moves on a circle of 5 cm.
    turned = make_arm_space("joint", arm).fk(q + 0.1 * np.eye(arm.dof)[-1])
    assert np.linalg.norm(turned[:3, 3] - T_base_ee[:3, 3]) <= 0.1 * 0.05 + 1e-9


@few
@given(arms(), kinds, seeds)
def test_decoding_returns_what_was_encoded(arm: Arm, kind: str, seed: int) -> None:
    space = space_of(arm, kind)
    start = postures(arm, seed, 1)[0]
    q = arm.within_limits(start + np.random.default_rng(seed).uniform(-0.02, 0.02, arm.dof))
    decoded = space.decode(space.encode(q, start=start), seed=start, current=start)
    if decoded.status is Status.OK:
        np.testing.assert_allclose(space.fk(decoded.q), space.fk(q), atol=EXACT)
        if not kind.endswith("task") and space.conditioning(q) > NEAR_FOLD:
            np.testing.assert_allclose(decoded.q, q, atol=50 * EXACT)
    else:  # only near where the space itself is singular
        assert space.conditioning(q) < NEAR_FOLD or kind.endswith("task")


@few
@given(arms(), kinds, seeds, st.floats(0, 6))
def test_a_command_is_finite_and_within_the_limits_whatever_the_action(
    arm: Arm, kind: str, seed: int, size: float
) -> None:
    space, rng = space_of(arm, kind), np.random.default_rng(seed)
    q = postures(arm, seed, 1)[0]
    decoded = space.decode(10**size * rng.normal(size=space.dim), seed=q)
    assert np.all(np.isfinite(decoded.q))
    assert np.all((decoded.q >= arm.lower - 1e-9) & (decoded.q <= arm.upper + 1e-9))


@few
@given(arms(), kinds, seeds, st.sampled_from(["quat", "rot6d"]))
def test_a_specification_means_the_same_after_json(arm: Arm, kind: str, seed: int, rotation: str) -> None:
    space = space_of(arm, kind, rotation)
    spec = json.loads(json.dumps(space.spec()))
    again: ArmSpace = arm_space_from_spec(spec, arm)
    assert again.spec() == spec and again.names == space.names
    q = postures(arm, seed, 1)[0] + np.linspace(0, 0.03, 4)[:, None]
    np.testing.assert_array_equal(again.encode(q), space.encode(q))


@few
@given(st.data())
def test_a_layout_splits_and_joins_any_vector(data: st.DataObject) -> None:
    arm = Arm.preset("panda")
    joints = [f"{joint}.pos" for joint in arm.joints]
    others = data.draw(st.lists(st.sampled_from(["gripper", "lift", "head"]), unique=True))
    names = data.draw(st.permutations([*joints, *others]))
    signs = tuple(data.draw(st.lists(st.sampled_from([1, -1]), min_size=arm.dof, max_size=arm.dof)))
    offsets = tuple(data.draw(st.lists(st.floats(-180, 180), min_size=arm.dof, max_size=arm.dof)))
    motors = Motors(tuple(joints), data.draw(st.sampled_from(list(UNITS))), signs, offsets)
    layout = Layout(tuple(names), (Part("", make_arm_space("erj", arm), motors),))
    q = postures(arm, data.draw(seeds), 1)[0]
    rest = np.array(data.draw(st.lists(st.floats(-1e3, 1e3), min_size=len(others), max_size=len(others))))
    vector = layout.join([q], rest)
    (angles,), passed = layout.split(vector)
    np.testing.assert_allclose(angles, q, atol=1e-9)
    np.testing.assert_array_equal(passed, rest)
    encoded = layout.encode(vector[None])[0]
    decoded = layout.decode(encoded, vector)
    np.testing.assert_allclose(decoded.vector, vector, atol=0.05)  # rad or degrees
