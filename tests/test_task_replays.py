"""The table of the tasks' replays, by the page's commands."""

import json
import runpy
from pathlib import Path

import pytest
from documented import ROOT, documented, run


@pytest.mark.slow
@pytest.mark.usefixtures("quiet_logging", "one_worker")
def test_the_pages_commands_write_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run("er-il", *documented("docs/tasks.md", "er-il generate"), "--episodes", "2")
    name, pattern, *options = documented("docs/tasks.md", "er-il replay")
    run("er-il", name, *map(str, sorted(tmp_path.glob(pattern))), *options)
    report = json.loads(Path("results/tasks/report.json").read_text())
    assert {cell["decoder"]: cell["successes"] for cell in report["cells"]} == dict.fromkeys(
        ("joint", "erj", "era", "task-nearest", "task-posture", "task-clear"), 2
    )
    table = runpy.run_path(str(ROOT / "docs/render_readme.py"))["shown"](report)
    heading, _, row = table.splitlines()
    decoders = "joint | erj | era | task-nearest | task-posture | task-clear"
    assert f"Leader | {decoders} | Reward at the start, at most" in heading
    assert row.startswith("| `reach_target` | 2/2 | 2/2 | 2/2 | 2/2 | 2/2 | 2/2 | 2/2 |") and row.endswith("| 1.00 |")
