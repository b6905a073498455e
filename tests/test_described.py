"""Joints wherever public datasets have them: found, proposed, encoded, decoded, and put back as they were."""

import json
import re
import runpy
import shlex
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from lerobot.configs.types import FeatureType
from lerobot.datasets import LeRobotDataset
from lerobot.datasets.aggregate import aggregate_datasets
from lerobot.datasets.utils import BackwardCompatibilityError
from lerobot.utils.feature_utils import dataset_to_policy_features
from packaging.version import Version
from public_schemas import (
    AXIS_ANGLE,
    DROID_JOINTS,
    G1,
    LENGTHS,
    PANDA,
    Columns,
    agibot,
    beside_poses,
    droid,
    joint_paths,
    lagged,
    libero,
    older,
    unitree,
    write_columns,
)

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.cli.arm_options import ArmOptions
from er_il.datasets.changes import are_changes
from er_il.datasets.column_source import ColumnSource, following
from er_il.datasets.dataset import Dataset
from er_il.datasets.described import described
from er_il.datasets.history import read_history
from er_il.datasets.joint_paths import read_joint_paths
from er_il.datasets.proposals import find_joints
from er_il.datasets.schema import SOURCE_ACTION, SOURCE_JOINTS, STATE, dimension_names
from er_il.datasets.verification import read_whole, verify
from er_il.datasets.wiring import Wiring, read_wirings
from er_il.robots.processors import DecodePolicyAction
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError

SCHEMAS = {each.__name__: each for each in (droid, beside_poses, libero, unitree)}
SCHEMAS |= {"agibot": partial(agibot, named=False)}
COMMANDED = np.concatenate(joint_paths()).astype(np.float32)
NEXT = np.concatenate([np.concatenate([q[1:], q[-1:]]) for q in joint_paths()]).astype(np.float32)
JOINTS = ("--arm", "panda", "--joints", *DROID_JOINTS)
ARMS = f"""
left: {{arm: panda, joints: [{", ".join(G1[:7])}]}}
right: {{arm: panda, joints: [{", ".join(G1[7:])}]}}
"""
AGIBOT_ARMS = """
left:
  arm: panda
  from: [actions.joint.position, actions.effector.position]
  state_from: [observation.states.joint.position]
  joints: [0, 1, 2, 3, 4, 5, 6]
right:
  arm: panda
  from: [actions.joint.position]
  state_from: [observation.states.joint.position]
  joints: [7, 8, 9, 10, 11, 12, 13]
"""


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("public")
    for name, write in SCHEMAS.items():
        write(root / name)
    (root / "arms.yaml").write_text(ARMS)
    (root / "agibot.yaml").write_text(AGIBOT_ARMS)
    return root


@pytest.fixture
def er_il(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    """Run the command line; returns what it printed, or the line that it ended with."""

    def run(*words: object) -> str:
        monkeypatch.setattr(sys, "argv", ["er-il", *map(str, words)])
        capsys.readouterr()
        try:
            main()
        except SystemExit as end:
            assert end.code == USER_MISTAKE
            said = capsys.readouterr().err.strip()
            assert len(said.splitlines()) == 1, said
            return said
        return capsys.readouterr().out

    return run


def given(error: str) -> list[str]:
    """The options that an error proposes."""
    (found,) = re.findall(r": give (--.*?)\.(?: Or in|$)", error)
    return shlex.split(found)


def checked(root: Path) -> Dataset:
    """An encoded dataset whose actions decode to the joints that it kept, from measured ones."""
    verification = verify(*read_whole(root), 1, lambda done, total: None)
    assert verification.compared and not verification.broken() and not any(verification.findings.values())
    assert max(each.error.max() for each in verification.episodes) < 1e-3
    dataset = Dataset(root)
    outputs = {
        name for name, each in dataset_to_policy_features(dataset.features).items() if each.type is FeatureType.ACTION
    }
    assert outputs == {ACTION}
    assert dataset.measured_joints(dataset.layout) is not None
    # As er-il attach would, which needs the measured joints in the policy's state.
    DecodePolicyAction(spec=dataset.spec, period=0.05, on_invalid="hold", state_names=list(dataset.names(STATE)))
    return dataset


def test_joints_beside_poses_are_proposed_and_the_proposal_works(places: Path, tmp_path: Path, er_il) -> None:
    encode = ("encode", places / "beside_poses", "--to", "erj", "--arm", "panda", "--out", tmp_path / "out")
    error = er_il(*encode)
    assert "Which dimensions are the joints of panda" in error
    assert "The joints of panda seem to be in action.joint_position (joint_0, " in error
    assert f"Or in observation.state ({', '.join(DROID_JOINTS)}; rad, measured)." in error
    assert given(error) == ["--from", "action.joint_position", "action:gripper"]
    said = er_il(*encode, *given(error))
    assert "The joint vectors are from action.joint_position; action:gripper." in said
    assert "Renamed to source.*, since LeRobot takes every column named action* for actions: action.joint_pos" in said
    dataset, source = checked(tmp_path / "out"), Dataset(places / "beside_poses")
    assert dataset.names(ACTION)[-1] == "gripper"
    assert np.array_equal(dataset.vectors(SOURCE_JOINTS)[:, :7], COMMANDED)
    assert np.array_equal(dataset.vectors(SOURCE_ACTION), source.vectors(ACTION))
    kept = json.loads((tmp_path / "out/meta/stats.json").read_text())
    before = json.loads((places / "beside_poses/meta/stats.json").read_text())
    assert kept["source.action.joint_position"] == before["action.joint_position"]
    assert "action.joint_position" not in kept
    loaded = LeRobotDataset("lab/out", root=tmp_path / "out", video_backend="pyav")
    assert sorted(loaded.hf_dataset.column_names) == sorted(dataset.features)


@pytest.mark.parametrize(
    "arm", ["panda", "xarm7"]
)  # a panda's fourth joint is never near zero; all of an xArm7's can be
def test_changes_are_not_taken_for_angles(places: Path, tmp_path: Path, er_il, arm: str) -> None:
    source = places / "libero" if arm == "panda" else libero(tmp_path / "xarm", Arm.preset(arm))
    encode = ("encode", source, "--to", "erj", "--arm", arm, "--out", tmp_path / "out")
    error = er_il(*encode, "--joints", *AXIS_ANGLE, "gripper")
    assert f"look like changes (deltas), not like angles of {arm}: they stay around zero" in error
    assert given(error) == given(er_il(*encode))
    assert given(error)[:3] == ["--from", "observation.states.joint_state", "action:gripper"]
    assert not (tmp_path / "out").exists()
    er_il(*encode, *given(error))
    checked(tmp_path / "out")


def test_measured_joints_command_the_frame_before(places: Path, tmp_path: Path, er_il) -> None:
    columns = ("--from", "observation.states.joint_state", "action:gripper")
    columns += ("--state-from", "observation.states.joint_state", "observation.state")
    said = er_il("encode", places / "libero", "--to", "erj", "--arm", "panda", *columns, "--out", tmp_path / "out")
    dataset, source = checked(tmp_path / "out"), Dataset(places / "libero")
    assert np.array_equal(dataset.vectors(SOURCE_JOINTS)[:, :7], NEXT)
    assert np.array_equal(dataset.vectors(SOURCE_JOINTS)[:, 7], source.vectors(ACTION)[:, 6])  # commanded: not moved
    assert dataset.names(STATE) == (*DROID_JOINTS, *source.names(STATE))
    assert np.array_equal(dataset.vectors(STATE)[:, :7], COMMANDED)
    assert np.array_equal(dataset.vectors("source.observation.state"), source.vectors(STATE))
    lost = "how hard it pushed against what held it, is lost."
    assert lost in said and lost in (tmp_path / "out/README.md").read_text()
    (entry,) = read_history(tmp_path / "out")
    assert (entry["from"], entry["state_from"]) == (list(columns[1:3]), list(columns[4:]))


def test_another_dataset_of_the_same_frames_has_the_joints(places: Path, tmp_path: Path, er_il) -> None:
    bare = droid(tmp_path / "bare", dropped=["action", "action.joint_position"])
    encode = ("encode", bare, "--to", "era", "--arm", "panda", "--out", tmp_path / "out")
    assert "bare has no column action: name the columns of the joints with --from" in er_il(*encode)
    said = er_il(*encode, "--from", f"{places / 'droid'}:action.joint_position", "action.gripper_position")
    assert "The joint vectors are from droid:action.joint_position; action.gripper_position." in said
    dataset = checked(tmp_path / "out")
    assert np.array_equal(dataset.vectors(SOURCE_JOINTS)[:, :7], COMMANDED)
    assert str(places) not in (tmp_path / "out/meta/er_il.json").read_text()


@pytest.mark.parametrize(("name", "options"), [("droid", JOINTS), ("unitree", ("--arms", "arms.yaml"))])
def test_back_in_joints_lerobot_merges_it_with_the_source(
    places: Path, tmp_path: Path, er_il, monkeypatch: pytest.MonkeyPatch, name: str, options: tuple[str, ...]
) -> None:
    monkeypatch.chdir(places)
    er_il("encode", name, "--to", "erj", *options, "--out", tmp_path / "erj")
    encoded = checked(tmp_path / "erj")
    assert SOURCE_ACTION in encoded.features
    er_il("encode", tmp_path / "erj", "--to", "era", "--out", tmp_path / "era")  # remembers across spaces
    er_il("encode", tmp_path / "era", "--to", "joint", "--out", tmp_path / "back")
    source, back = Dataset(places / name), Dataset(tmp_path / "back")
    assert back.features == source.features
    for column in (each for each in source.features if source.features[each]["dtype"] == "float32"):
        assert np.abs(back.column(column) - source.column(column)).max() < 1e-3
    merged = tmp_path / "merged"
    aggregate_datasets(["lab/a", "lab/b"], "lab/merged", roots=[places / name, tmp_path / "back"], aggr_root=merged)
    loaded = LeRobotDataset("lab/merged", root=merged, video_backend="pyav")
    assert loaded.num_frames == 2 * sum(LENGTHS)
    rows = Dataset(merged).vectors(ACTION)
    assert np.allclose(rows[: sum(LENGTHS)], rows[sum(LENGTHS) :], atol=1e-3)
    # The record says what its actions mean.
    checked_again = verify(*read_whole(tmp_path / "back"), 1, lambda done, total: None)
    assert not checked_again.broken()
    er_il("encode", tmp_path / "back", "--to", "task", "--out", tmp_path / "task")
    assert Dataset(tmp_path / "task").layout.kind == "task"


def test_two_arms_in_one_column_without_names(places: Path, tmp_path: Path, er_il) -> None:
    encode = ("encode", places / "agibot", "--to", "erj", "--out", tmp_path / "out")
    er_il(*encode, "--arms", places / "agibot.yaml")
    dataset = checked(tmp_path / "out")
    assert dataset.names(ACTION)[-2:] == ("actions.effector.position.0", "actions.effector.position.1")
    source = Dataset(places / "agibot")
    assert np.array_equal(dataset.vectors(SOURCE_JOINTS)[:, :14], source.vectors("actions.joint.position"))
    assert np.array_equal(dataset.vectors(STATE), source.vectors("observation.states.joint.position"))
    assert not any(name.startswith("actions") for name in dataset.features)
    (tmp_path / "arms.yaml").write_text("left: {arm: panda}\nright: {arm: panda}")
    error = er_il(*encode, "--arms", tmp_path / "arms.yaml")
    assert (
        "The joints of left seem to be in actions.joint.position (dimensions 0, 1, 2, 3, 4, 5, 6; rad): give" in error
    )
    proposed = re.search(r"seem to be in .*?: give (.*?) in its entry of the file of arms", error)
    assert proposed
    (tmp_path / "left.yaml").write_text(f"left: {{arm: panda, {proposed[1]}}}")
    _, layout = described(source, read_wirings(tmp_path / "left.yaml"))
    assert len(layout.parts[0].motors.state) == 7


def test_names_of_sides_and_spellings_tell_which_arm_is_which(places: Path) -> None:
    for label, names in (("left", G1[:7]), ("right", G1[7:])):
        (first, *_) = find_joints(Dataset(places / "unitree"), PANDA, label)
        assert (first.source.column, first.source.names) == (ACTION, tuple(names))
        (first, *_) = find_joints(Dataset(places / "agibot"), PANDA, label)
        assert first.source.names == tuple("0123456" if label == "left" else ("7", "8", "9", "10", "11", "12", "13"))


def test_joint_changes_are_told_from_a_column_of_joints_beside_them(tmp_path: Path) -> None:
    names = {ACTION: None, "action.joint_position": None, STATE: None}
    episodes: list[Columns] = [
        {ACTION: np.diff(q, axis=0), "action.joint_position": q[1:], STATE: q[:-1]} for q in joint_paths()
    ]
    dataset = Dataset(write_columns(tmp_path / "changes", names, episodes))
    with pytest.raises(
        DatasetError, match=r"0, 1, .* look like changes .* give --from action.joint_position --state-j"
    ):
        described(dataset, [Wiring(arm="panda", joints=tuple("0123456"))])
    degrees = [{"action.joints": np.rad2deg(q)} for q in joint_paths()]
    dataset = Dataset(write_columns(tmp_path / "degrees", {"action.joints": None}, degrees))
    with pytest.raises(DatasetError, match=r"has no column action: .* give --from action.joints --units deg\.$"):
        described(dataset, [Wiring(arm="panda")])


def test_what_is_left_out_is_said(places: Path, tmp_path: Path, er_il) -> None:
    said = er_il("encode", places / "droid", "--to", "erj", *JOINTS, "--no-keep", "--out", tmp_path / "out")
    assert "Left out, since LeRobot takes every column named action* for actions: action.joint_position, " in said
    assert not any(name.startswith("source.") for name in Dataset(tmp_path / "out").features)


def test_commands_that_cannot_work_are_one_line(places: Path, tmp_path: Path, er_il) -> None:
    other = beside_poses(tmp_path / "other")
    info = json.loads((other / "meta/info.json").read_text())
    (other / "meta/info.json").write_text(json.dumps(info | {"fps": 15}))
    short = beside_poses(tmp_path / "short")
    path = short / "data/chunk-000/file-000.parquet"
    table = pq.read_table(path)
    swapped = np.repeat(np.arange(2), LENGTHS[::-1])
    table = table.set_column(table.schema.get_field_index("episode_index"), "episode_index", pa.array(swapped))
    pq.write_table(table, path)
    encode = ("encode", places / "beside_poses", "--to", "erj", "--out", tmp_path / "out")
    for words, message in (
        (
            ("--from", "action.joints"),
            "Unknown column of .*beside_poses 'action.joints'. Valid: action, action.j",
        ),
        (("--from", "action:elbow"), "Unknown dimension of action 'elbow'. Valid: x, y, z"),
        (("--from", "acton:gripper"), "Unknown column, or folder of a dataset, 'acton'. Valid: action, "),
        (("--from", f"{tmp_path}:action"), "is not a LeRobot v3 dataset"),
        (("--from", f"{other}:action"), "other has 15 frames a second, .*beside_poses has 20: they do not match"),
        (
            ("--from", f"{short}:action"),
            "Episode 0 of .*short has 9 frames, that of .*poses 12: they do not match",
        ),
        (("--from", "action", "--joints", "elbow"), "Unknown dimension of the action 'elbow'"),
        (("--from", "action.joint_position", "--joints", "elbow"), "Unknown dimension of the joint vector 'elbow'"),
        (("--from", "action.joint_position", "action.joint_position:joint_0"), "A dimension is given twice"),
    ):
        error = er_il(*encode, "--arm", "panda", *words)
        assert re.search(message, error), error
    error = er_il(*encode, "--from", "action.joint_position")
    assert "--from and --state-from say where an arm's joints are: give --arm or --arms, too." in error


def test_the_command_that_converts_an_old_dataset_works(places: Path, tmp_path: Path, er_il, monkeypatch) -> None:
    old = older(places / "droid", tmp_path / "old")
    encode = ("encode", old, "--to", "erj", *JOINTS, "--out", tmp_path / "out")
    error = er_il(*encode)
    assert "is a LeRobot dataset of version v2.1, not v3.0. Convert it with: python -m " in error
    words = shlex.split(error[error.index("lerobot.scripts") : error.index(" (the old one stays in old_old)")])
    assert words[1:] == ["--repo-id=local/old", f"--root={old}", "--push-to-hub=false"]
    monkeypatch.setattr(sys, "argv", words)
    runpy.run_module(words[0], run_name="__main__")
    er_il(*encode)
    assert np.allclose(checked(tmp_path / "out").vectors(SOURCE_ACTION)[:, :7], COMMANDED)


def test_an_old_dataset_on_the_hub_is_told(er_il, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*args: object, **kwargs: object) -> None:
        raise BackwardCompatibilityError("lab/folding", Version("2.1"))

    monkeypatch.setattr("lerobot.datasets.LeRobotDataset", refuse)
    error = er_il("encode", "lab/folding", "--to", "erj", *JOINTS, "--out", tmp_path / "out")
    assert "--repo-id=lab/folding --root=folding --push-to-hub=false" in error


def test_paths_of_joints_are_read_from_any_column(places: Path) -> None:
    wiring = Wiring(arm="panda", from_=("observation.state",), joints=tuple(DROID_JOINTS))
    (arm,) = read_joint_paths(places / "droid", [wiring])
    for path, q in zip(arm.paths, joint_paths(), strict=True):
        measured = lagged(q).astype(np.float32)
        assert np.array_equal(path.measured, measured)
        assert np.array_equal(path.commanded, np.concatenate([measured[1:], measured[-1:]]))


def test_columns_of_the_options_are_those_of_all_arms_of_a_file(places: Path) -> None:
    source = Dataset(places / "unitree")
    dataset, layout = described(source, ArmOptions(arms=places / "arms.yaml", from_=(STATE,)).wirings())
    assert dataset.names(ACTION) == source.names(STATE)
    expected = following(source.vectors(STATE), source.episodes.values())
    assert np.array_equal(dataset.vectors(ACTION), expected)
    measured = dataset.measured_joints(layout)
    assert measured is not None
    for first, part in zip((0, 7), layout.parts, strict=True):
        assert np.allclose(layout.angles(part, expected), expected[:, first : first + 7])
        assert np.allclose(layout.angles(part, measured), source.vectors(STATE)[:, first : first + 7])
    own = ArmOptions(arms=places / "agibot.yaml", from_=("ignored",)).wirings()  # where the file says nothing
    assert own == read_wirings(places / "agibot.yaml")


def test_numbers_of_unnamed_dimensions_do_not_tie_a_state_to_joints(tmp_path: Path) -> None:
    episodes = [{"action.arm": q, STATE: np.hstack([q, q])} for q in joint_paths()]  # a state of anything
    dataset = Dataset(write_columns(tmp_path / "unnamed", {"action.arm": None, STATE: None}, episodes))
    for wiring, state in (
        (Wiring(arm="panda", from_=("action.arm",)), ""),
        (Wiring(arm="panda", from_=("action.arm",), state_joints=tuple("3456789")), "3456789"),
        (Wiring(arm="panda", from_=(STATE,), joints=tuple("0123456")), "0123456"),
    ):
        _, layout = described(dataset, [wiring])
        assert layout.parts[0].motors.state == tuple(state)


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ([["a", "b", "c"]], ("a", "b", "c")),
        ({"axes": ["a", "b", "c"]}, ("a", "b", "c")),
        ({"motors": ["a", "g", "g"]}, ("a", "g_1", "g_2")),
        ({"a": 0, "b": 1, "c": 2}, ("a", "b", "c")),
        ([["a", "b"], ["c"]], ("a", "b", "c")),
        (["g", "g", "g_1"], ("0", "1", "2")),
        (["state"], ("0", "1", "2")),
        (None, ("0", "1", "2")),
    ],
)
def test_names_are_found_however_they_are_nested(names, found) -> None:
    assert dimension_names({"names": names, "shape": (3,)}) == found


@pytest.mark.parametrize("column", ["observation.state", "state", "joint_position", "joint_state", "source.state"])
def test_columns_are_measured_unless_their_names_say_otherwise(column: str) -> None:
    assert ColumnSource(Dataset(Path()), column, ()).measured


@pytest.mark.parametrize("column", ["action", "actions.joint", "leader.joints", "source.joints", "joint_targets"])
def test_names_of_columns_tell_commands(column: str) -> None:
    assert not ColumnSource(Dataset(Path()), column, ()).measured


def test_the_last_frame_of_an_episode_commands_itself() -> None:
    values = np.arange(5, dtype=np.float32)[:, None]
    assert following(values, [slice(0, 3), slice(3, 5)])[:, 0].tolist() == [1, 2, 2, 4, 4]


def test_an_arm_that_hangs_at_zero_does_not_pass_for_changes() -> None:
    rng = np.random.default_rng(0)
    for name in ("openarm_v2_left", "xarm7"):
        arm = Arm.preset(name)
        hanging = np.clip(rng.uniform(-0.1, 0.1, (50, arm.dof)), arm.lower, arm.upper)
        assert not are_changes(arm, hanging, hanging + 0.01)
        assert not are_changes(arm, hanging, None)
        assert are_changes(arm, hanging, np.tile(arm.home + 0.8, (50, 1)))
    assert are_changes(PANDA, rng.uniform(-0.1, 0.1, (50, 7)), None)
    assert not are_changes(PANDA, COMMANDED.astype(np.float64), None)
