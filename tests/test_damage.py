"""Damaged files of datasets and policies: each is told in one line with exit code 2, before anything is written."""

import json
import os
import shutil
import signal
from collections.abc import Callable
from concurrent.futures import BrokenExecutor
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from er_il import cli
from er_il.datasets.dataset import Dataset
from er_il.datasets.integrity import check_whole
from er_il.datasets.number_checks import number_problems
from er_il.datasets.record import DatasetRecord
from er_il.envs.contract import decodes, policy_contract
from er_il.experiments.grid import Grid
from er_il.experiments.studies.prediction import read_training
from er_il.policy.configuration import default_steps
from er_il.policy.training import train_episodes
from er_il.support.atomic_files import atomic_folder, check_outside, check_writable, write_json
from er_il.support.errors import ErIlError
from er_il.support.failures import explanation
from er_il.support.workers import LocalExecutor

GOLDEN = Path(__file__).parent / "golden"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
DATA, EPISODES = "data/chunk-000/file-000.parquet", "meta/episodes/chunk-000/file-000.parquet"
NO_JSON = (b"", b"[]", b"null", b"nonsense", b"\xff\xfe{}", b"[" * 100_000, b'{"a": ' + b"9" * 5000 + b"}")

Edit = Callable[[Any], Any]


def put(*path: Any) -> Edit:
    """An edit of JSON: the last of the arguments takes the place that the others lead to; None removes it."""
    *way, last, value = path

    def edit(values: Any) -> Any:
        place = values
        for key in way:
            place = place[key]
        if value is None:
            del place[last]
        else:
            place[last] = value
        return values

    return edit


def drop(column: str) -> Edit:
    return lambda table: table.drop_columns([column])


def words(column: str) -> Edit:
    return lambda table: table.set_column(table.schema.get_field_index(column), column, pa.array(["x"] * len(table)))


def ragged(column: str) -> Edit:
    def edit(table: pa.Table) -> pa.Table:
        rows = pa.array([[1.0] * (1 + row % 2) for row in range(len(table))])
        return table.set_column(table.schema.get_field_index(column), column, rows)

    return edit


SPEC = ("features", "action", "info", "er_il")
# File, edit, and what is said of it.
EDITS = [
    (INFO, put("fps", None), "lacks fps"),
    (INFO, put("fps", "fast"), "fps"),
    (INFO, put("fps", 0), "fps"),
    (INFO, put("features", []), "features is []"),
    (INFO, put("features", "action", None), "holds no actions"),
    (INFO, put("features", "action", "shape", []), "features.action.shape"),
    (INFO, put("features", "action", "shape", [8]), "action"),
    (INFO, put("features", "action", "info", 7), "features.action.info is 7"),
    (INFO, put("features", "observation.state", "names", 7), "features.observation.state.names"),
    (INFO, put("features", "observation.state", "dtype", "float"), "features.observation.state.dtype is 'float'"),
    (INFO, put("total_episodes", 0), "holds no actions"),
    (INFO, put("total_episodes", 9), "its frames are not those of episodes 0 to 8"),
    (INFO, put("total_frames", 9), "frames, but meta/info.json says 9"),
    (INFO, put("codebase_version", "v2.1"), "version v2.1, not v3.0"),
    (INFO, put("splits", "train", 7), "splits.train is 7"),
    (INFO, put("splits", "train", "0:9"), "has 3 episodes; its splits take 0:9"),
    (INFO, put("splits", "train", "2:2"), "its splits take 2:2"),
    (INFO, put(*SPEC, []), "names no action space"),
    (INFO, put(*SPEC, "space", 7), "names no action space"),
    (INFO, put(*SPEC, "arm", 7), "arm is 7"),
    (INFO, put(*SPEC, "arm", "xml", 7), "arm.xml is 7"),
    (INFO, put(*SPEC, "hemisphere", [0.0, 0.0, 0.0, 0.0]), "no unit quaternion"),
    (INFO, put(*SPEC, "hemisphere", "x"), "hemisphere is 'x'"),
    (STATS, put("action", None), "the mean of action is not a list of 9 numbers"),
    (STATS, put("action", "std", [1.0]), "the std of action is not a list of 9 numbers"),
    (STATS, put("action", "max", ["x"] * 9), "the max of action is not a list of 9 numbers"),
    (STATS, put("observation.state", 7), "the mean of observation.state"),
    (TASKS, drop("task_index"), "numbers no tasks"),
    (TASKS, lambda table: table.slice(0, 0), "lacks the task 0"),
    (DATA, drop("episode_index"), "has no column episode_index"),
    (DATA, drop("timestamp"), "has no column timestamp"),
    (DATA, drop("task_index"), "has no column task_index"),
    (DATA, words("action"), "column action"),
    (DATA, ragged("action"), "column action"),
    (DATA, lambda table: table.slice(0, 9), "holds 9 frames"),
    (EPISODES, drop("dataset_from_index"), "has no column dataset_from_index"),
    (EPISODES, words("length"), "column length"),
    (EPISODES, lambda table: table.slice(1), "does not describe the episodes"),
    ("meta/recipe.json", put("recipe", "task", None), "recipe.json is damaged: The recipe lacks task"),
    ("meta/recipe.json", put("dropped", []), "recipe.json is not the record"),
]


def read_all(root: Path) -> None:
    """Read a dataset as the commands do."""
    dataset = Dataset(root)
    _ = dataset.layout, dataset.vectors("action"), dataset.episodes
    check_whole(dataset)
    train_episodes(dataset.info)
    DatasetRecord.read(root)


def copied(source: Path, folder: Path) -> Path:
    return Path(shutil.copytree(source, folder / "copy"))


@pytest.mark.parametrize(("name", "edit", "said"), EDITS)
def test_a_wrong_value_in_a_dataset_is_told(name: str, edit: Edit, said: str, reach_cup: Path, tmp_path: Path) -> None:
    root = copied(reach_cup / "erj", tmp_path)
    read_all(root)
    path = root / name
    if path.suffix == ".json":
        path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    else:
        pq.write_table(edit(pq.read_table(path)), path)
    with pytest.raises(ErIlError) as caught:
        read_all(root)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_state_whose_names_are_lost_measures_no_joints(reach_cup: Path, tmp_path: Path) -> None:
    root = copied(reach_cup / "erj", tmp_path)
    info = json.loads((root / INFO).read_text())
    info["features"]["observation.state"]["names"].pop()  # they no longer fit the shape: the dimensions are numbered
    (root / INFO).write_text(json.dumps(info))
    read_all(root)
    dataset = Dataset(root)
    assert dataset.measured_joints(dataset.layout) is None
    assert not number_problems(dataset, dataset.layout)


@pytest.mark.parametrize("name", [INFO, STATS, TASKS, DATA, EPISODES, "meta/recipe.json"])
def test_a_missing_or_truncated_file_of_a_dataset_is_told(name: str, reach_cup: Path, tmp_path: Path) -> None:
    root = copied(reach_cup / "erj", tmp_path)
    path, good = root / name, (reach_cup / "erj" / name).read_bytes()
    junk = NO_JSON if path.suffix == ".json" else (b"", b"hello", bytes(len(good)))
    for content in (None, good[: len(good) // 2], good[:-10], *junk):
        path.unlink(missing_ok=True)
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(ErIlError, match=Path(name).name if content is not None else "."):
            read_all(root)


def test_a_damaged_policy_is_told(tmp_path: Path) -> None:
    def read(root: Path) -> None:
        decodes(root)
        policy_contract(root)

    root = copied(GOLDEN / "policy", tmp_path)
    read(root)
    for name in ("config.json", "policy_postprocessor.json", "train_config.json"):
        good = (root / name).read_text()
        for content in (*NO_JSON, b"{}"):
            if name == "train_config.json" and content == b"{}":
                continue  # the policy's tag tells what that would
            (root / name).write_bytes(content)
            with pytest.raises(ErIlError):
                read(root)
        (root / name).write_text(good)


@pytest.mark.parametrize(
    "text",
    [
        "!!python/object/apply:os.system [echo hi]",
        "steps: 3\npolicy: [1, 2]",
        "steps: many",
        "[1, 2",
        "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
        + "\n".join(
            f"{n}: &{n} [*{p}, *{p}, *{p}, *{p}, *{p}, *{p}, *{p}]" for p, n in zip("abcdefgh", "bcdefghi", strict=True)
        ),
        "&a [*a]",
        "\0",
        "3",
        "",
    ],
)
def test_yaml_is_read_as_data(text: str, tmp_path: Path) -> None:
    path = tmp_path / "some.yaml"
    path.write_text(text)
    for read in (Grid.from_file, default_steps, read_training):
        with pytest.raises(ErIlError, match=r"some\.yaml") as caught:
            read(path)
        assert "\n" not in str(caught.value) and len(str(caught.value)) < 1000


def fail(error: BaseException) -> Callable[..., Any]:
    def command(name: str, module: str) -> Any:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ErIlError("two\nlines \x1b[31m"), "error: two lines  [31m\n"),
        (OSError(28, "No space left on device", "out/a.json"), "error: No space left on device: out/a.json\n"),
        (OSError(28, "No space left on device"), "error: No space left on device\n"),
        (pa.ArrowInvalid("broken"), "error: A file cannot be read (ArrowInvalid): broken\n"),
        (
            json.JSONDecodeError("no", "", 0),
            "error: A file cannot be read (JSONDecodeError): no: line 1 column 1 (char 0)\n",
        ),
    ],
)
def test_failures_of_libraries_are_one_line(
    error: BaseException, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cli, "_command", fail(error))
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert (left.value.code, capsys.readouterr().err) == (cli.USER_MISTAKE, said)


@pytest.mark.parametrize("error", [TypeError("ours"), KeyError("ours"), ValueError("ours")])
def test_our_own_mistakes_keep_their_traceback(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "_command", fail(error))
    with pytest.raises(type(error), match="ours") as caught:
        cli.main()
    assert "report it" in caught.value.__notes__[-1]
    assert explanation(error) is None


def test_a_worker_that_the_system_killed_is_no_bug() -> None:
    with pytest.raises(BrokenExecutor) as caught, LocalExecutor(1) as workers:
        workers.submit(_kill_self).result()
    said = explanation(caught.value)
    assert said is not None and said.startswith("A worker process was killed")


def _kill_self() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_full_disk_is_told_with_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        write_json(tmp_path / "a.json", {})
    assert explanation(caught.value) == f"No space left on device: {tmp_path / 'a.json'}"
    with pytest.raises(OSError, match="No space left") as caught, atomic_folder(tmp_path / "folder"):
        full()
    assert caught.value.filename == str(tmp_path / "folder")
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_cannot_be_written_is_found_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    check_writable(tmp_path / "new" / "out", tmp_path / "file", None)
    with pytest.raises(NotADirectoryError, match="file"):
        check_writable(tmp_path / "file" / "out")
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # tests may run as root, who may write anywhere
    with pytest.raises(PermissionError, match="cannot be written"):
        check_writable(tmp_path / "new")


def test_an_output_inside_its_source_is_refused(tmp_path: Path) -> None:
    (tmp_path / "source").mkdir()
    check_outside(tmp_path / "source2", tmp_path / "source")
    for inside in ("source", "source/out", "source2/../source/out"):
        with pytest.raises(ErIlError, match="lies in"):
            check_outside(tmp_path / inside, tmp_path / "source")
