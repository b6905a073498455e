import hashlib
import json
import shutil

import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset

from er_il.arms.arm import Arm
from er_il.datasets.dataset import Dataset
from er_il.datasets.encoding import encode_dataset
from er_il.datasets.normalisation import bound_rotation_deviation
from er_il.datasets.schema import LEADER_JOINTS, SOURCE_ACTION, action_feature
from er_il.spaces.layout import Layout
from er_il.spaces.registry import make_arm_space
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError

PANDA = Arm.preset("panda")
LENGTHS = (30, 25)


def _episodes():
    """Joint paths in which the hand turns by more than half a turn: its quaternion's sign must be carried along."""
    for number, length in enumerate(LENGTHS):
        q = np.tile(PANDA.home, (length, 1))
        q[:, -1] = np.linspace(PANDA.lower[-1] + 0.1, PANDA.upper[-1] - 0.1, length)
        q[:, 0] += 0.3 * np.sin(np.arange(length) / 5 + number)
        yield np.column_stack([q, np.linspace(1, 0, length)]).astype(np.float32)


def _write(root, kind, leader=False, dtype="float32"):
    """Write the episodes with LeRobot itself, actions in the space ``kind``."""
    layout = _layout(kind)
    columns = {ACTION: action_feature(layout) | {"dtype": dtype}, "observation.state": _state()}
    if leader:
        columns[LEADER_JOINTS] = action_feature(_layout("joint")) | {"info": None}
    dataset = LeRobotDataset.create("er_il/test", 20, columns, root=root, video_backend="pyav")
    for joints in _episodes():
        actions = layout.encode(joints).astype(dtype)
        for t, row in enumerate(joints):
            frame = {ACTION: actions[t], "observation.state": np.float32([t, 2 * t]), "task": "turn"}
            dataset.add_frame(frame | ({LEADER_JOINTS: row} if leader else {}))
        dataset.save_episode()
    dataset.finalize()
    return root


def _layout(kind):
    return Layout.of_space(make_arm_space(kind, PANDA))


def _state():
    return {"dtype": "float32", "shape": (2,), "names": ["a", "b"]}


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    return _write(tmp_path_factory.mktemp("joint") / "data", "joint")


@pytest.mark.parametrize("kind", ["erj", "task"])
def test_re_encoding_equals_recording_in_that_space(joint, tmp_path, kind):
    native = _write(tmp_path / "native", kind)
    bound_rotation_deviation(native)
    encode_dataset(Dataset(joint), tmp_path / "encoded", _layout(kind))
    encoded = tmp_path / "encoded"
    _assert_same_data(encoded, native)
    assert (encoded / "meta/info.json").read_bytes() == (native / "meta/info.json").read_bytes()
    assert json.loads((encoded / "meta/stats.json").read_text()) == json.loads((native / "meta/stats.json").read_text())
    episodes = "meta/episodes/chunk-000/file-000.parquet"
    ours, theirs = pq.read_table(encoded / episodes), pq.read_table(native / episodes)
    assert ours.schema.equals(theirs.schema)
    assert ours.to_pydict() == theirs.to_pydict()


def test_the_source_is_untouched_and_leftovers_are_cleared(joint, tmp_path):
    before = _hashes(joint)
    (tmp_path / "encoded.partial" / "data").mkdir(parents=True)
    (tmp_path / "encoded.partial" / "data" / "half.parquet").write_bytes(b"half")
    encode_dataset(Dataset(joint), tmp_path / "encoded", _layout("erj"))
    assert _hashes(joint) == before
    assert [path.name for path in tmp_path.iterdir()] == ["encoded"]
    assert not list(tmp_path.rglob("half.parquet"))


def test_the_recorded_joints_survive_any_chain_of_encodings(tmp_path):
    first = _write(tmp_path / "first", "joint", leader=True)
    encode_dataset(Dataset(first), tmp_path / "task", _layout("task"))  # drops the elbow
    encode_dataset(Dataset(tmp_path / "task"), tmp_path / "back", _layout("joint"))
    _assert_same_data(tmp_path / "back", first)


def test_kept_actions_are_the_sources_own_in_type_and_statistics(tmp_path):
    source, target = _write(tmp_path / "source", "joint", dtype="float64"), tmp_path / "erj"
    encode_dataset(Dataset(source), target, _layout("erj"), keep=True)
    loaded = LeRobotDataset("er_il/test", root=target, video_backend="pyav")
    kept, original = loaded.features[SOURCE_ACTION], Dataset(source).features[ACTION]
    assert (kept["dtype"], kept["shape"]) == ("float64", original["shape"])
    assert np.array_equal(Dataset(target).column(SOURCE_ACTION), Dataset(source).column(ACTION))
    ours, theirs = (json.loads((root / "meta/stats.json").read_text()) for root in (target, source))
    assert ours[SOURCE_ACTION] == theirs[ACTION]
    ours, theirs = (pq.read_table(root / "meta/episodes") for root in (target, source))
    for statistic in loaded.meta.stats[SOURCE_ACTION]:
        copied = ours.column(f"stats/{SOURCE_ACTION}/{statistic}")
        assert copied.equals(theirs.column(f"stats/{ACTION}/{statistic}"))


def test_a_source_without_statistics_gets_those_of_the_encoded_actions(joint, tmp_path):
    source = shutil.copytree(joint, tmp_path / "source")
    (source / "meta/stats.json").unlink()
    episodes = source / "meta/episodes/chunk-000/file-000.parquet"
    table = pq.read_table(episodes)
    pq.write_table(table.select([name for name in table.column_names if not name.startswith("stats/")]), episodes)
    encode_dataset(Dataset(source), tmp_path / "erj", _layout("erj"), keep=True)
    loaded = LeRobotDataset("er_il/test", root=tmp_path / "erj", video_backend="pyav")
    assert list(loaded.meta.stats) == [ACTION]
    assert loaded.meta.stats[ACTION]["count"] == sum(LENGTHS)
    assert SOURCE_ACTION in loaded.features


def test_quaternions_are_continuous_within_and_start_afresh_in_each_episode(joint, tmp_path):
    encode_dataset(Dataset(joint), tmp_path / "task", _layout("task"))
    dataset = LeRobotDataset("er_il/test", root=tmp_path / "task", video_backend="pyav")
    quaternions = np.stack(dataset.hf_dataset[ACTION])[:, 3:7]
    one, other = np.split(quaternions, [LENGTHS[0]])
    for episode in (one, other):
        assert np.all(np.sum(episode[1:] * episode[:-1], axis=1) > 0.9)
    assert one[0] @ other[0] > 0.9
    assert one[0] @ one[-1] < 0  # the turn takes it to the other hemisphere


def test_datasets_that_cannot_be_encoded(joint, tmp_path):
    erj = _layout("erj")
    task = _write(tmp_path / "task", "task")
    with pytest.raises(DatasetError, match="no joint angles"):
        encode_dataset(Dataset(task), tmp_path / "out", erj)
    with pytest.raises(DatasetError, match=r"not a LeRobot v3 dataset"):
        encode_dataset(Dataset(tmp_path / "nothing"), tmp_path / "out", erj)
    with pytest.raises(FileExistsError):
        encode_dataset(Dataset(joint), task, erj)
    assert not (tmp_path / "out").exists()


def _assert_same_data(one, other):
    """Same rows, types and row groups; only the fingerprint that Hugging Face draws for each dataset may differ."""
    files = [pq.ParquetFile(root / "data/chunk-000/file-000.parquet") for root in (one, other)]
    ours, theirs = (file.read() for file in files)
    assert ours.equals(theirs)
    assert ours.schema.equals(theirs.schema)
    described = [json.loads(table.schema.metadata[b"huggingface"])["info"] for table in (ours, theirs)]
    assert described[0] == described[1]
    assert files[0].num_row_groups == files[1].num_row_groups


def _hashes(root):
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in root.rglob("*") if path.is_file()}
