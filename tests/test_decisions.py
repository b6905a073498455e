"""The count of decisions a second, by the page's command."""

import json
import runpy
import sys
from pathlib import Path

import pytest
from documented import ROOT, documented

from er_il.envs.learning import MODES


def test_every_mode_takes_its_turns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script, *_ = documented("docs/reinforcement_learning.md", "python benchmarks/decisions.py")
    monkeypatch.setattr(sys, "argv", [script, "--decisions", "30", "--rounds", "2", "--out", str(tmp_path)])
    runpy.run_path(str(ROOT / script), run_name="__main__")
    rows = json.loads((tmp_path / "report.json").read_text())["decisions"]
    assert [row["mode"] for row in rows] == list(MODES)
    assert all(row["decisions"] == 60 and row["per_second"] > 10 for row in rows)
    assert rows[0]["relative_to_joint"] == 1.0 and rows[0]["invalid_rate"] == 0.0  # joints stop at their limits
