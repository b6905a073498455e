"""A dataset that er_il did not make: two arms in degrees in one vector, names in mixed order."""

import hashlib
import json
import os
import shutil
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from foreign import ARMS, LEFT_JOINTS, LENGTHS, NAMES, bimanual, write_bimanual
from lerobot.datasets import LeRobotDataset, dataset_metadata
from lerobot.scripts import lerobot_edit_dataset, lerobot_train

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.datasets import decoding, encoding
from er_il.datasets.dataset import Dataset
from er_il.datasets.hub import find_dataset
from er_il.datasets.normalisation import LEAST_ROTATION
from er_il.datasets.schema import SOURCE_ACTION, STATE
from er_il.spaces.spec import ACTION

RECORDED = np.concatenate([np.stack([each[name] for name in NAMES], axis=1) for each in bimanual()])


@pytest.fixture(scope="module")
def places(tmp_path_factory):
    """The foreign dataset with a camera, its arms, and its encoding in ERJ by the command line."""
    root = tmp_path_factory.mktemp("foreign")
    write_bimanual(root / "source", camera=True)
    (root / "arms.yaml").write_text(ARMS)
    before = _hashes(root / "source")
    with pytest.MonkeyPatch.context() as patch:
        _run(patch, "encode", root / "source", "--to", "erj", "--arms", root / "arms.yaml", "--out", root / "erj")
    assert _hashes(root / "source") == before
    assert sorted(path.name for path in root.iterdir()) == ["arms.yaml", "erj", "source"]
    return root


def _run(patch, *arguments):
    patch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


def _stock(patch, command, *arguments):
    """Run one of LeRobot's commands in this process."""
    patch.setattr(sys, "argv", ["lerobot", *map(str, arguments)])
    command.main()


def _verified(patch, dataset, out):
    _run(patch, "verify", dataset, "--out", out)
    assert (out / "round_trip.png").read_bytes().startswith(b"\x89PNG")
    return json.loads((out / "report.json").read_text())


def _hashes(root):
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in root.rglob("*") if path.is_file()}


def test_only_the_actions_differ(places):
    source, encoded = places / "source", places / "erj"
    one, other = (pq.read_table(root / "data") for root in (source, encoded))
    assert other.column_names == [*one.column_names, SOURCE_ACTION]
    untouched = [name for name in one.column_names if name != ACTION]
    assert other.select(untouched).equals(one.select(untouched))
    assert np.array_equal(Dataset(encoded).vectors(SOURCE_ACTION), Dataset(source).vectors(ACTION))
    videos = sorted(path.relative_to(source) for path in source.glob("videos/**/*.mp4"))
    assert videos
    assert all((source / path).samefile(encoded / path) for path in videos)
    features = Dataset(encoded).features
    assert features[STATE] == Dataset(source).features[STATE]
    assert features[ACTION]["names"][:3] == ["left_ee.x", "left_ee.y", "left_ee.z"]
    assert len(features[ACTION]["names"]) == 2 * 8 + 3
    card = (encoded / "README.md").read_text()
    assert card.startswith("---")
    assert "| 8 | `right_ee.x` | end-effector position [m] |" in card
    assert json.loads((encoded / "meta/er_il.json").read_text())[0]["source"] == "source"


def test_statistics_are_lerobots_but_for_still_rotations(places, tmp_path):
    """Write the encoded dataset once more with plain LeRobot calls: the same statistics, digit by digit."""
    actions, features = Dataset(places / "erj").vectors(ACTION), Dataset(places / "erj").features
    columns = {name: features[name] for name in (ACTION, SOURCE_ACTION)}
    native = LeRobotDataset.create("lab/native", 20, columns, root=tmp_path / "native", video_backend="pyav")
    kept = Dataset(places / "erj").vectors(SOURCE_ACTION)
    for start, stop in zip(np.cumsum([0, *LENGTHS[:-1]]), np.cumsum(LENGTHS), strict=True):
        for row in range(start, stop):
            native.add_frame({ACTION: actions[row], SOURCE_ACTION: kept[row], "task": "fold"})
        native.save_episode()
    native.finalize()
    ours, theirs = (json.loads((root / "meta/stats.json").read_text()) for root in (places / "erj", native.root))
    episodes = [pq.read_table(root / "meta/episodes") for root in (places / "erj", native.root)]
    spread = theirs[ACTION]["std"]
    still = ["ee.q" in name and spread[i] < LEAST_ROTATION for i, name in enumerate(features[ACTION]["names"])]
    assert any(still) and not all(still)
    theirs[ACTION]["std"] = np.where(still, LEAST_ROTATION, spread).tolist()
    for name in columns:
        assert ours[name] == theirs[name]
        for statistic in theirs[name]:
            column = f"stats/{name}/{statistic}"
            assert episodes[0].column(column).equals(episodes[1].column(column))
    for name in (STATE, "note", "observation.images.top"):
        assert ours[name] == json.loads((places / "source/meta/stats.json").read_text())[name]


@pytest.mark.parametrize("kind", ["erj", "era", "task"])
def test_the_round_trip_is_exact_where_the_elbow_is_commanded(places, tmp_path, monkeypatch, kind):
    dataset = places / "erj"
    if kind != "erj":  # another space from an encoded dataset: the arms are known, the joints were kept
        dataset = tmp_path / kind
        _run(monkeypatch, "encode", places / "erj", "--to", kind, "--rotation", "rot6d", "--out", dataset)
    report = _verified(monkeypatch, dataset, tmp_path / "report")
    assert (report["frames"], report["episodes"]) == (sum(LENGTHS), len(LENGTHS))
    for arm in ("left", "right"):
        error = report["arms"][arm]["joint_error_unflagged"]["p100"]
        assert error <= 1e-3 if kind != "task" else error > 1e-3
        assert report["arms"][arm]["position_error"]["p100"] <= 1e-4
        assert report["arms"][arm]["finding"] == ""
        assert report["arms"][arm]["quaternions_other_side"] == 0


def test_back_to_joints_through_the_decoder(places, tmp_path, monkeypatch):
    args = ("--to", "erj", "--arms", places / "arms.yaml", "--no-keep", "--out", tmp_path / "bare")
    _run(monkeypatch, "encode", places / "source", *args)
    assert SOURCE_ACTION not in Dataset(tmp_path / "bare").features
    _run(monkeypatch, "encode", tmp_path / "bare", "--to", "joint", "--out", tmp_path / "back")
    back = Dataset(tmp_path / "back").vectors(ACTION)
    assert Dataset(tmp_path / "back").features[ACTION]["names"] == list(NAMES)
    assert np.abs(back - RECORDED).max() < np.rad2deg(1e-3)
    _run(monkeypatch, "encode", tmp_path / "bare", "--to", "task", "--out", tmp_path / "task")  # decodes on the way
    _run(monkeypatch, "encode", places / "erj", "--to", "task", "--out", tmp_path / "direct")
    assert (
        np.abs(Dataset(tmp_path / "task").vectors(ACTION) - Dataset(tmp_path / "direct").vectors(ACTION)).max() < 1e-4
    )


def test_flagged_frames_and_intervals_near_singularities_are_found(places, tmp_path, monkeypatch):
    """Episode 1 passes through the stretched elbow, 2 has an action that cannot be decoded, in 3 the hand spins."""
    names = [f"{joint}.pos" for joint in Dataset(places / "erj").layout.parts[0].space.arm.joints]
    feature = {"dtype": "float32", "shape": (7,), "names": names}
    dataset = LeRobotDataset.create("lab/one", 20, {ACTION: feature}, root=tmp_path / "one", video_backend="pyav")
    home = np.array([0.3, 0.2, 0.1, -1.5, 0.2, 1.7, 0.8], dtype=np.float32)
    for episode in range(4):
        for t in range(30):
            row = home + 0.01 * t
            if episode == 1:
                row[3] = -1.5 + 1.4 * np.sin(np.pi * t / 29)
            if episode == 3:
                row[[0, 6]] = np.linspace(-2.5, 2.5, 30)[t] * np.array([1, -1])
            dataset.add_frame({ACTION: np.float32(row), "task": "stretch"})
        dataset.save_episode()
    dataset.finalize()
    _run(monkeypatch, "encode", tmp_path / "one", "--to", "erj", "--arm", "panda", "--out", tmp_path / "erj")
    _spoil(tmp_path / "erj", row=75)
    report = _verified(monkeypatch, tmp_path / "erj", tmp_path / "report")
    assert report["invalid_by_episode"] == {"2": {"invalid": 1}}
    intervals = report["near_singularity"]
    assert intervals
    assert {(each["episode"], each["arm"]) for each in intervals} == {(1, "panda")}
    assert any(each["first"] <= 15 <= each["last"] for each in intervals)
    assert report["arms"]["panda"]["joint_error_unflagged"]["p100"] <= 1e-3
    assert 1 < report["arms"]["panda"]["flagged"] < 30
    assert 0 < report["arms"]["panda"]["quaternions_other_side"] < 0.25


def _spoil(dataset, row):
    path = next(dataset.glob("data/*/*.parquet"))
    table = pq.read_table(path)
    actions = np.array(table.column(ACTION).to_pylist(), dtype=np.float32)
    actions[row, 3:7] = 0.0  # a zero quaternion
    field = table.schema.field(ACTION)
    import pyarrow as pa

    pq.write_table(
        table.set_column(table.schema.get_field_index(ACTION), field, pa.array(actions.tolist(), field.type)), path
    )


@pytest.mark.slow
def test_what_lerobot_edits_still_decodes_and_trains(places, tmp_path, monkeypatch):
    def edit(*arguments):
        _stock(monkeypatch, lerobot_edit_dataset, *arguments)

    common = ("--repo_id", "lab/erj", "--root", places / "erj")
    edit(
        *common,
        "--new_root",
        tmp_path / "split",
        "--operation.type",
        "split",
        "--operation.splits",
        '{"a": [0], "b": [1, 2]}',
    )
    edit(
        *common,
        "--new_repo_id",
        "lab/less",
        "--new_root",
        tmp_path / "less",
        "--operation.type",
        "delete_episodes",
        "--operation.episode_indices",
        "[1]",
    )
    roots = sorted(path for path in (tmp_path / "split").iterdir() if path.is_dir())
    merge = f"[{', '.join(repr(str(path)) for path in (*roots, tmp_path / 'less'))}]"
    edit(
        "--new_repo_id",
        "lab/merged",
        "--new_root",
        tmp_path / "merged",
        "--operation.type",
        "merge",
        "--operation.repo_ids",
        "['lab/a', 'lab/b', 'lab/less']",
        "--operation.roots",
        merge,
        "--operation.concatenate_data",
        "false",
    )
    assert len(list(tmp_path.glob("merged/data/*/*.parquet"))) == 3
    _run(monkeypatch, "encode", tmp_path / "merged", "--to", "era", "--out", tmp_path / "again")
    spec = Dataset(places / "erj").features[ACTION]["info"]
    for dataset in (*roots, tmp_path / "less", tmp_path / "merged"):
        assert Dataset(dataset).features[ACTION]["info"] == spec
    sizes = {roots[0]: 1, roots[1]: 2, tmp_path / "less": 2, tmp_path / "merged": 5, tmp_path / "again": 5}
    for dataset, episodes in sizes.items():
        report = _verified(monkeypatch, dataset, tmp_path / "report" / dataset.name)
        assert report["episodes"] == episodes
        assert max(arm["joint_error_unflagged"]["p100"] for arm in report["arms"].values()) <= 1e-3
    tiny = ("--policy.type=act", "--policy.device=cpu", "--policy.push_to_hub=false", "--num_workers=0")
    tiny += ("--policy.pretrained_backbone_weights=null", "--dataset.video_backend=pyav", "--steps=2", "--batch_size=2")
    tiny += ("--policy.dim_model=32", "--policy.n_heads=2", "--policy.dim_feedforward=32", "--policy.chunk_size=5")
    tiny += ("--policy.n_action_steps=5",)
    out = tmp_path / "policy"  # of the dataset that was split, deleted from, and merged
    where = ("--dataset.repo_id=lab/merged", f"--dataset.root={tmp_path / 'merged'}", f"--output_dir={out}")
    _stock(monkeypatch, lerobot_train, *where, *tiny)
    config = json.loads((out / "checkpoints/last/pretrained_model/config.json").read_text())
    assert config["output_features"]["action"]["shape"] == [19]
    assert SOURCE_ACTION not in config["input_features"] | config["output_features"]


def _one_arm(places, tmp_path, monkeypatch, *options):
    options = ("--arm", "panda", "--joints", *LEFT_JOINTS, *options)
    _run(monkeypatch, "encode", places / "source", "--to", "erj", *options, "--out", tmp_path / "out")
    return _mistake(monkeypatch, "verify", tmp_path / "out", "--out", tmp_path / "report")


def _mistake(monkeypatch, *arguments):
    with pytest.raises(SystemExit) as exit_info:
        _run(monkeypatch, *arguments)
    assert exit_info.value.code == USER_MISTAKE


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--arm", "xarm7", "--units", "deg"), "It looks like the wrong arm: the values fit panda (--arm panda)"),
        (("--joints", *reversed(LEFT_JOINTS), "--units", "deg"), f"by their names it is --joints {LEFT_JOINTS[0]}"),
    ],
)
def test_mistakes_about_the_arm_are_told_apart(places, tmp_path, monkeypatch, capsys, options, message):
    _one_arm(places, tmp_path, monkeypatch, *options)
    error = capsys.readouterr().err.strip()
    assert message in error
    assert len(error.splitlines()) == 1
    assert (tmp_path / "report/report.json").exists()


def test_degrees_are_not_encoded_as_radians(places, tmp_path, monkeypatch, capsys):
    options = ("--arm", "panda", "--joints", *LEFT_JOINTS, "--out", tmp_path / "out")
    _mistake(monkeypatch, "encode", places / "source", "--to", "erj", *options)
    error = capsys.readouterr().err.strip()
    assert "of the joint values are outside panda's limits" in error
    assert "It looks like wrong units: the values are degrees, not radians (--units deg)" in error
    assert "episode 2: action left_joint" in error and len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_commands_that_cannot_work_are_one_line(places, tmp_path, monkeypatch, capsys):
    out, source = ("--out", tmp_path / "out"), places / "source"
    old = tmp_path / "old"
    (old / "meta").mkdir(parents=True)
    old_info = json.loads((source / "meta/info.json").read_text()) | {"codebase_version": "v2.1"}
    (old / "meta/info.json").write_text(json.dumps(old_info))
    killed = tmp_path / "killed"  # LeRobot writes the end of its files last
    shutil.copytree(source, killed)
    os.truncate(next(killed.glob("data/*/*.parquet")), 100)
    panda = ("--to", "erj", "--arm", "panda", "--joints", *LEFT_JOINTS)
    for arguments, message in (
        (("encode", tmp_path / "none", *panda, *out), "is not a LeRobot v3 dataset"),
        (("encode", "nobody/nothing", *panda, *out), "nobody/nothing is neither a folder nor a dataset that LeRobot"),
        (("encode", old, *panda, *out), "version v2.1, not v3.0"),
        (("encode", killed, *panda, *out), "is damaged, as by a recording that was killed"),
        (("encode", source, "--to", "erj", *out), "does not say which arm it is of"),
        (("encode", source, "--to", "polar", *out), "Unknown action space 'polar'"),
        (("encode", places / "erj", *panda, *out), "leave out --arm"),
        (("encode", source, *panda, "--out", places / "erj"), "The target exists already"),
        (("verify", source), "does not say which arm it is of"),
    ):
        _mistake(monkeypatch, *arguments)
        error = capsys.readouterr().err.strip()
        assert message in error
        assert len(error.splitlines()) == 1, error
    assert sorted(path.name for path in tmp_path.iterdir()) == ["killed", "old"]


def test_an_arm_of_a_file_needs_it_only_once(places, tmp_path, monkeypatch, capsys):
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(Arm.preset("panda").urdf.read_text())
    encode = ("encode", places / "source", "--to", "era", "--out", tmp_path / "era", "--arm", urdf, "--units", "deg")
    encode = (*encode, "--joints", *LEFT_JOINTS)
    _mistake(monkeypatch, *encode)
    assert "give --ee-frame too" in capsys.readouterr().err
    frames = ("--ee-frame", "panda_hand", "--angle-frames", "panda_link2", "panda_link4", "panda_link6")
    _run(monkeypatch, *encode, *frames)
    urdf.unlink()
    report = _verified(monkeypatch, tmp_path / "era", tmp_path / "report")
    assert report["arms"]["panda"]["joint_error_unflagged"]["p100"] <= 1e-3


def test_worker_processes_decode_the_same(places, monkeypatch):
    dataset = Dataset(places / "erj")
    layout = dataset.layout
    episodes = decoding.read_encoded_episodes(dataset, layout)
    alone = decoding.decode_episodes(layout, episodes, workers=1)
    monkeypatch.setattr(decoding, "FEW_FRAMES", 0)
    done: list[int] = []
    shared = decoding.decode_episodes(layout, episodes, workers=2, advance=done.append)
    assert done == list(LENGTHS)
    for one, other in zip(alone, shared, strict=True):
        assert np.allclose(one.vectors, other.vectors, rtol=0, atol=1e-9)
        assert np.allclose(one.conditioning, other.conditioning, rtol=0, atol=1e-9)


def test_a_failure_leaves_nothing_behind(places, tmp_path, monkeypatch):
    def fail(folder):
        assert (folder / "meta/info.json").exists()
        raise KeyboardInterrupt

    layout = Dataset(places / "erj").layout
    with pytest.raises(KeyboardInterrupt):
        encoding.encode_dataset(Dataset(places / "erj"), tmp_path / "out", layout, finish=fail)
    assert list(tmp_path.iterdir()) == []


def test_repository_ids_are_looked_up_by_lerobot(places, tmp_path, monkeypatch):
    """LeRobot finds datasets under HF_LEROBOT_HOME; here one that is a snapshot in the hub's cache, all links."""
    cached = tmp_path / "datasets--lab--bimanual"
    (cached / "blobs").mkdir(parents=True)
    for number, path in enumerate(each for each in (places / "source").rglob("*") if each.is_file()):
        link = cached / "snapshots/main" / path.relative_to(places / "source")
        link.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, cached / "blobs" / str(number))
        link.symlink_to(cached / "blobs" / str(number))
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab/bimanual").symlink_to(cached / "snapshots/main")
    monkeypatch.setattr(dataset_metadata, "HF_LEROBOT_HOME", tmp_path)
    assert find_dataset("lab/bimanual") == tmp_path / "lab/bimanual"
    arms = ("--arms", places / "arms.yaml")
    _run(monkeypatch, "encode", "lab/bimanual", "--to", "delta_erj", *arms, "--out", tmp_path / "out")
    assert not any(path.is_symlink() for path in (tmp_path / "out").rglob("*"))
    report = _verified(monkeypatch, tmp_path / "out", tmp_path / "report")
    assert max(arm["joint_error_unflagged"]["p100"] for arm in report["arms"].values()) <= 1e-3
