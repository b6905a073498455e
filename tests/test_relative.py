"""Chunk-relative actions: their values, their statistics in datasets, and what has none."""

import json
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.progress import Progress
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.arms.robot import robot_arms
from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.datasets.reencoding import reencode
from er_il.datasets.schema import STATE
from er_il.envs.contract import Contract
from er_il.envs.decoders import DECODERS, decoder
from er_il.kinematics.rotation import Rot6d, Rot6dRows, make_rotation
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import SPACES, make_arm_space
from er_il.spaces.relative import RelativeActions
from er_il.support.errors import DatasetError, ErIlError, ShapeError, UnknownNameError

PANDA = Arm.preset("panda")
JOINTS = tuple(f"{joint}.pos" for joint in PANDA.joints)
CHUNK = 5
B, T = 3, 4


def layout(space: str, rotation: str = "quat", units: str = "deg") -> Layout:
    """A Panda whose motors count in degrees with another sign and an offset, and its gripper first."""
    motors = Motors(JOINTS, units, (1, -1, 1, 1, 1, 1, 1), (0, 0, 10, 0, 0, 0, 0), JOINTS)
    own = Layout(("gripper.pos", *JOINTS), (Part("", make_arm_space(space, PANDA, rotation=rotation), motors),))
    return own.in_space(space, rotation, chunk=CHUNK)


def chunks(of: Layout, spread: float = 0.2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joint angles q (B, T, 7) [rad], the same as encoded vectors, and states with other numbers around the joints."""
    rng = np.random.default_rng(3)
    q = np.array(PANDA.home) + spread * rng.uniform(-1, 1, (B, T, 7))
    (part,) = of.parts
    vectors = np.concatenate([rng.random((B, T, 1)), part.motors.values(q)], axis=-1)
    measured = part.motors.values(q[:, 0] + 0.02)
    states = np.concatenate([rng.random((B, 1)), measured[:, ::-1]], axis=-1)
    return q, np.stack([of.encode(each) for each in vectors]), states


STATE_NAMES = ("fan", *JOINTS[::-1])


@pytest.mark.parametrize("space", [f"rel_{space}" for space in SPACES])
@pytest.mark.parametrize("rotation", ["quat", "rot6d", "rot6d_rows"])
def test_relative_then_absolute_is_where_it_began(space: str, rotation: str) -> None:
    of = layout(space, rotation)
    _, actions, states = chunks(of)
    convert = RelativeActions(of, STATE_NAMES)
    relative = convert.relative(actions, states)
    assert np.abs(relative - actions).max() > 0.1
    assert convert.absolute(relative, states) == pytest.approx(actions, abs=1e-9)
    assert (relative[..., -1] == actions[..., -1]).all() or space == "rel_joint"  # the gripper is what it was


def test_poses_are_in_the_frame_of_the_measured_hand() -> None:
    of = layout("rel_erj")
    q, actions, states = chunks(of)
    relative = RelativeActions(of, STATE_NAMES).relative(actions, states)
    (part,) = of.parts
    for b in range(B):
        now = part.space.fk(q[b, 0] + 0.02)
        R_now = Rotation.from_matrix(now[:3, :3])
        for t in range(T):
            goal = part.space.fk(q[b, t])
            turn = (R_now.inv() * Rotation.from_matrix(goal[:3, :3])).as_quat(canonical=True)  # w >= 0
            assert relative[b, t, :3] == pytest.approx(R_now.inv().apply(goal[:3, 3] - now[:3, 3]), abs=1e-9)
            assert relative[b, t, 3:7] == pytest.approx(turn, abs=1e-9)
            assert relative[b, t, 7] == pytest.approx(q[b, t, 0] - q[b, 0, 0] - 0.02)


def test_an_arm_turned_about_its_base_acts_the_same_relative_to_itself() -> None:
    of = layout("rel_erj", "rot6d")
    q, _, _ = chunks(of)
    turned = q + np.array([0.7, 0, 0, 0, 0, 0, 0])
    (part,) = of.parts
    found = []
    for angles in (q, turned):
        vectors = np.concatenate([np.ones((B, T, 1)), part.motors.values(angles)], axis=-1)
        actions = np.stack([of.encode(each) for each in vectors])
        found.append(RelativeActions(of, of.names).relative(actions, vectors[:, 0]))
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    assert found[0][:, 0, :3] == pytest.approx(0.0, abs=1e-9)  # the first command is where the arm is


def test_joints_keep_the_robots_units_and_arm_angles_take_the_short_way() -> None:
    of = layout("rel_joint")
    q, actions, states = chunks(of)
    relative = RelativeActions(of, STATE_NAMES).relative(actions, states)
    assert relative[0, 1, 1] == pytest.approx(np.degrees(q[0, 1, 0] - q[0, 0, 0] - 0.02))
    assert relative[0, 1, 2] == pytest.approx(-np.degrees(q[0, 1, 1] - q[0, 0, 1] - 0.02))  # a reversed motor
    of = layout("rel_era")
    _, actions, states = chunks(of)
    convert = RelativeActions(of, STATE_NAMES)
    beyond = actions + 2 * np.pi * np.eye(actions.shape[-1])[of.encoded_names.index("arm_angle")]
    assert convert.relative(beyond, states) == pytest.approx(convert.relative(actions, states), abs=1e-9)


def test_each_arm_counts_from_its_own_joints() -> None:
    arms = robot_arms("openarm_v2")
    of = Layout.of_spaces({label: make_arm_space("rel_erj", arm) for label, arm in arms.items()}, CHUNK)
    rng = np.random.default_rng(0)
    homes = of.join([arm.home for arm in arms.values()], np.ones(2))
    vectors = homes + 0.1 * rng.uniform(-1, 1, (1, T, len(of.names)))
    convert, actions = RelativeActions(of, of.names), of.encode(vectors[0])[None]
    relative = convert.relative(actions, vectors[:, 0])
    assert convert.absolute(relative, vectors[:, 0]) == pytest.approx(actions, abs=1e-9)
    moved = vectors[:, 0].copy()
    moved[:, of.indices(of.parts[1])] += 0.1  # the right arm is elsewhere: the left one's part does not change
    left = len(of.parts[0].names)
    assert (convert.relative(actions, moved)[..., :left] == relative[..., :left]).all()
    assert np.abs(convert.relative(actions, moved)[..., left : 2 * left] - relative[..., left : 2 * left]).max() > 0.01


@pytest.mark.parametrize("rotation", ["quat", "rot6d", "rot6d_rows"])
def test_what_is_no_number_or_no_rotation_stays_within_its_action(rotation: str) -> None:
    of = layout("rel_erj", rotation)
    _, actions, states = chunks(of)
    convert = RelativeActions(of, STATE_NAMES)
    relative = convert.relative(actions, states)
    relative[0, 1, 3:-2] = 0.0
    relative[1, 2, 0] = np.nan
    states[2, 1] = np.nan
    bad = np.isnan(convert.absolute(relative, states))[..., :-1]
    assert bad[0, 1, :-1].all() and bad[1, 2, 0] and bad[2].all()
    assert not bad[0, [0, 2, 3]].any() and not bad[1, [0, 1, 3]].any()


def test_rot6d_by_rows_is_the_first_two_rows() -> None:
    R = Rotation.random(6, np.random.default_rng(2)).as_matrix().reshape(2, 3, 3, 3)
    by_rows, by_columns = Rot6dRows(), Rot6d()
    assert (by_rows.encode(R)[1, 2] == [*R[1, 2, 0], *R[1, 2, 1]]).all()
    assert (by_rows.encode(R) == by_columns.encode(R.swapaxes(-2, -1))).all()
    scaled = 1.3 * by_rows.encode(R[0])
    assert by_rows.decode(scaled[1]) == pytest.approx(R[0, 1])
    batch, rotates = by_rows.decode_batch(np.vstack([scaled, np.zeros(6)]).T, np)
    assert np.moveaxis(batch, -1, 0)[:3] == pytest.approx(R[0]) and rotates.tolist() == [True, True, True, False]
    space = make_arm_space("erj", PANDA, rotation="rot6d_rows")
    assert space.names[3:9] == ("ee.r11", "ee.r12", "ee.r13", "ee.r21", "ee.r22", "ee.r23")
    assert Contract.of_space(space).rotation == "rot6d_rows" != Contract.of_space(layout("erj", "rot6d")).rotation
    with pytest.raises(UnknownNameError, match="Valid: quat, rot6d, rot6d_rows"):
        make_rotation("rot9d", R[0, 0])


@pytest.mark.parametrize("space", ["rel_joint", "rel_task", "rel_erj", "rel_era", "rel_erx"])
def test_a_specification_says_the_chunk_and_commands_stay_those_of_the_space(space: str) -> None:
    of = layout(space, units="rad")
    spec = json.loads(json.dumps(of.spec()))
    again = Layout.from_spec(spec)
    assert (spec["space"], spec["chunk"], again.chunk, again.kind) == (space, CHUNK, CHUNK, space)
    assert again.spec() == spec
    plain = layout(space.removeprefix("rel_"))
    assert (again.commands, again.encoded_names) == (plain.kind, plain.encoded_names)
    assert Contract.of_spec(spec).space == space
    alone = Layout.of_spaces({"": make_arm_space(space, PANDA)}, CHUNK)
    assert Layout.from_spec(alone.spec()).spec() == alone.spec()
    assert Contract.of_space(alone).tag == Contract.of_space(Layout.of_space(make_arm_space(space, PANDA))).tag.replace(
        f":{plain.kind}/", f":{space}/"
    )


def test_decoders_decode_the_commands() -> None:
    assert decoder("rel_erj").layout_of({"": PANDA}).kind == "rel_erj"
    assert decoder("rel_erj@panda_joint3").layout_of({"": PANDA}).encoded_names[-2] == "panda_joint3.pos"
    assert {"rel_joint", "rel_era", "rel_erx", "rel_era@stereo", "rel_task-nearest"} <= DECODERS.keys()
    with pytest.raises(UnknownNameError, match="rel_erj"):
        decoder("rel_ejr")


def test_mistakes() -> None:
    with pytest.raises(ErIlError, match=r"need the measured joints panda_joint1\.pos in it; it has fan, "):
        RelativeActions(layout("rel_erj"), ("fan", *JOINTS[1:]))
    with pytest.raises(ErIlError, match="A chunk has at least one action, not 0"):
        layout("rel_erj").in_space("rel_erj", "quat", chunk=0)
    of = layout("rel_erj")
    _, actions, states = chunks(of)
    convert = RelativeActions(of, STATE_NAMES)
    with pytest.raises(ShapeError, match="Chunks of actions"):
        convert.relative(actions[0], states)
    with pytest.raises(ShapeError, match="The states"):
        convert.absolute(actions, states[:2])


def encode(source: Path, out: Path, space: str, rotation: str = "quat", chunk: int = CHUNK) -> Dataset:
    reencode(
        str(source), out, space, rotation=rotation, wirings=(), keep=True, chunk=chunk, on_progress=lambda *_: None
    )
    return Dataset(out)


def by_hand(dataset: Dataset, chunk: int) -> np.ndarray:
    """All actions of all chunks relative to the state at their start, one by one from the recorded hand's poses."""
    actions, states = dataset.vectors("action").astype(float), dataset.vectors(STATE).astype(float)
    names = dataset.names(STATE)
    hand = [names.index(name) for name in ("ee.x", "ee.y", "ee.z", "ee.qx", "ee.qy", "ee.qz", "ee.qw")]
    found = []
    for rows in dataset.episodes.values():
        for start in range(rows.start, rows.stop):
            pose = states[start, hand]
            R_now = Rotation.from_quat(pose[3:])
            for row in range(start, min(start + chunk, rows.stop)):
                action = actions[row]
                turn = (R_now.inv() * Rotation.from_quat(action[3:7])).as_quat(canonical=True)
                shift = R_now.inv().apply(action[:3] - pose[:3])
                found.append([*shift, *turn, action[7] - states[start, 0], action[8]])
    return np.array(found)


def test_the_statistics_are_those_of_the_chunks(reach_cup: Path, tmp_path: Path) -> None:
    dataset = encode(reach_cup / "erj", tmp_path / "rel", "rel_erj")
    absolute = Dataset(reach_cup / "erj")
    assert (dataset.vectors("action") == absolute.vectors("action")).all()  # only statistics and specification differ
    stats, samples = json.loads((tmp_path / "rel/meta/stats.json").read_text()), by_hand(dataset, CHUNK)
    own = stats["action"]
    deviation = samples.std(axis=0)
    deviation[3:7] = np.maximum(deviation[3:7], 0.05)
    for name, expected in {
        "min": samples.min(axis=0),
        "max": samples.max(axis=0),
        "mean": samples.mean(axis=0),
        "std": deviation,
        "q50": np.median(samples, axis=0),
    }.items():
        assert own[name] == pytest.approx(expected, abs=3e-2 if name == "q50" else 2e-4), name
    assert own["count"] == [len(samples)]
    before = json.loads((reach_cup / "erj/meta/stats.json").read_text())
    assert {key: stats[key] for key in stats if key != "action"} == {
        key: before[key] for key in before if key != "action"
    }
    # LeRobot's edits aggregate the statistics of episodes.
    (file,) = (tmp_path / "rel/meta/episodes").rglob("*.parquet")
    episodes = pd.read_parquet(file)
    lengths = [len(range(rows.start, rows.stop)) for rows in dataset.episodes.values()]
    counts = [CHUNK * length - CHUNK * (CHUNK - 1) // 2 for length in lengths]
    assert list(chain(*episodes["stats/action/count"])) == counts
    assert np.min(episodes["stats/action/min"].tolist(), axis=0) == pytest.approx(samples.min(axis=0), abs=2e-4)
    again = encode(tmp_path / "rel", tmp_path / "back", "erj")
    assert again.spec == absolute.spec
    assert json.loads((tmp_path / "back/meta/stats.json").read_text()) == before


def test_relative_joints_are_joints(reach_cup: Path, tmp_path: Path) -> None:
    dataset = encode(reach_cup / "joint", tmp_path / "rel", "rel_joint", chunk=1)
    assert dataset.joints_column(dataset.layout) and "source.action" not in dataset.features
    own = json.loads((tmp_path / "rel/meta/stats.json").read_text())["action"]
    change = dataset.vectors("action") - dataset.vectors(STATE)[:, :8]
    assert own["mean"][:7] == pytest.approx(change.mean(axis=0)[:7], abs=1e-5)
    assert own["mean"][7] == pytest.approx(dataset.vectors("action")[:, 7].mean(), abs=1e-5)


def test_generate_writes_them_as_encode_does(reach_cup: Path, tmp_path: Path) -> None:
    recipe = Recipe.load("reach_cup").resized(3)
    out = tmp_path / "data"
    for space in ("joint", "erj"):
        (out / space).parent.mkdir(exist_ok=True)
        (out / space).symlink_to(reach_cup / space)
    generate(recipe, ["rel_erj"], out, Progress(disable=True), workers=1, chunk=CHUNK)
    encoded = encode(reach_cup / "erj", tmp_path / "rel", "rel_erj")
    assert Dataset(out / "rel_erj").spec == encoded.spec
    texts = [(root / "meta/stats.json").read_text() for root in (out / "rel_erj", encoded.root)]
    assert texts[0] == texts[1]
    with pytest.raises(DatasetError, match="rel_erj has chunks of 5 actions"):
        generate(recipe, ["rel_erj"], out, Progress(disable=True), workers=1)
