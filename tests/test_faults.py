"""The fault programme, small: a command killed and run again, damaged inputs, actions that mean nothing."""

import json
import runpy
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from damage import Damage, damage
from documented import ROOT, documented
from fault_actions import fuzz_commanders, fuzz_environments
from fault_inputs import FAULTS, TRIALS, try_damaged
from fault_kills import commands, kill_often
from hypothesis import given, settings
from hypothesis import strategies as st

GOLDEN = Path(__file__).parent / "golden"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What version 0.1.0 wrote, as undamaged inputs."""
    folder = tmp_path_factory.mktemp("data")
    shutil.copytree(GOLDEN / "push_button_elbow/erj", folder / "erj")
    shutil.copytree(GOLDEN / "policy", folder / "policy")
    return folder


@settings(max_examples=40, deadline=None)
@given(damage(".json"), st.just({"a": [1, {"b": None}], "c": "text"}))
def test_damage_changes_a_file(drawn: Damage, document: dict[str, object]) -> None:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "file.json"
        file.write_text(before := json.dumps(document))
        words, spoil = drawn
        spoil(file)
        assert words
        if file.is_file():  # or deleted, or a folder now
            assert file.read_text(errors="replace") != before or "overwritten" in words or "is" in words


@pytest.mark.slow
def test_nothing_is_lost_and_damage_is_told(data: Path, tmp_path: Path) -> None:
    encode = next(index for index, each in enumerate(commands(data)) if each.name == "encode")
    killed = kill_often(encode, 2, 0, data, tmp_path / "kills")
    assert killed["not_resumed"] == 0, killed["faults"]
    chosen = {"verify": 6, "attach": 4}
    for index, trial in enumerate(TRIALS):
        if count := chosen.get(trial.arguments[0]):
            found = try_damaged(index, count, 0, data, tmp_path / f"inputs_{index}")
            assert found["damaged"] == count
            assert not sum(found[fault] for fault in FAULTS), found["faults"]


def test_the_pages_command_writes_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script, *_ = documented("docs/faults.md", "python benchmarks/faults.py")
    few = ["--kills", "0", "--damages", "0", "--actions", "60", "--steps", "40", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", [script, *few])
    runpy.run_path(str(ROOT / script), run_name="__main__")
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["commands"][0]["actions"] == 60 and report["environments"][0]["actions"] == 40
    assert report["meta"]["git"] and report["meta"]["seed"] == 0
    assert not (tmp_path / "jobs").exists()  # all is in the report


def test_no_action_leaves_the_limits() -> None:
    commanded, stepped = fuzz_commanders(300, 0), fuzz_environments(150, 0)
    assert commanded["actions"] == sum(commanded["statuses"].values()) == 300
    assert {"ok", "invalid"} < set(commanded["statuses"])
    for found in (commanded, stepped):
        for fault in ("not_finite", "outside_limits", "too_fast", "exceptions", "changed_by_refusal"):
            assert not found.get(fault), (fault, found)
