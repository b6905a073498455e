import json
import subprocess
import sys
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from er_il.support.atomic_files import PARTIAL, atomic_folder, work_folder, write_atomically, write_json
from er_il.support.errors import ErIlError


def test_a_file_is_complete_or_absent(tmp_path: Path):
    def fail(partial: Path) -> None:
        partial.write_text("half")
        assert partial.suffix == ".json"
        raise KeyboardInterrupt

    write_json(tmp_path / "new" / "report.json", {"a": 1})
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "new" / "report.json", fail)
    assert json.loads((tmp_path / "new" / "report.json").read_text()) == {"a": 1}
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["report.json"]


def test_two_writers_of_one_file_do_not_share_a_partial_file(tmp_path: Path):
    seen = []

    def write(partial: Path) -> None:
        seen.append(partial)
        if len(seen) == 1:
            write_atomically(tmp_path / "report.txt", write)
        partial.write_text(str(len(seen)))

    write_atomically(tmp_path / "report.txt", write)
    assert len(set(seen)) == 2
    assert all(PARTIAL in path.name for path in seen)
    assert [path.name for path in tmp_path.iterdir()] == ["report.txt"]


def test_a_folder_is_complete_or_absent(tmp_path: Path):
    (tmp_path / "out.partial" / "out").mkdir(parents=True)  # left by a process that was killed
    (tmp_path / "out.partial" / "out" / "old").write_text("half")
    with pytest.raises(KeyboardInterrupt), atomic_folder(tmp_path / "out") as partial:
        partial.mkdir()
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []
    with atomic_folder(tmp_path / "out") as partial:
        partial.mkdir()
        (partial / "new").write_text("whole")
        assert not (tmp_path / "out").exists()
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["new", "out"]
    with pytest.raises(FileExistsError), atomic_folder(tmp_path / "out"):
        pass


def test_one_process_at_a_time_writes_a_folder(tmp_path: Path):
    lines = ["import sys, pathlib", "from er_il.support.atomic_files import atomic_folder"]
    code = "\n".join([*lines, "with atomic_folder(pathlib.Path(sys.argv[1])) as folder: folder.mkdir()"])
    command = [sys.executable, "-c", code, str(tmp_path / "out")]
    with atomic_folder(tmp_path / "out") as partial:
        other = subprocess.run(command, capture_output=True, text=True, check=False)
        assert "ErIlError: Another command works in" in other.stderr
        partial.mkdir()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_the_folder_of_an_unfinished_run_stays_for_its_successor(tmp_path: Path):
    with pytest.raises(ErIlError), work_folder(tmp_path / "out") as work:
        (work / "demo.npz").write_text("")
        raise ErIlError
    with work_folder(tmp_path / "out") as work:
        (work / "demo.npz").unlink()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_another_process_finished_in_between_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def finished(target: Path) -> AbstractContextManager[Path]:
        target.mkdir()
        (target / "theirs").touch()
        return work_folder(target)

    monkeypatch.setattr("er_il.support.atomic_files.work_folder", finished)
    with pytest.raises(FileExistsError), atomic_folder(tmp_path / "out"):
        pytest.fail("written twice")
    assert [path.name for path in tmp_path.rglob("*")] == ["out", "theirs"]
