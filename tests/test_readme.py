"""The pages' tables are those of the results they name, and of the tasks there are."""

import json
import runpy
import shutil
from pathlib import Path

import pytest

from er_il.experiments.agents.grid import MODES
from er_il.report import agents_page, grid_page
from sim_tasks import TASKS
from sim_tasks.tasks.robot_task import RATE

ROOT = Path(__file__).resolve().parents[1]


def test_the_pages_tables_are_rendered_from_the_results() -> None:
    renderer = runpy.run_path(str(ROOT / "docs" / "render_readme.py"))
    found = []
    for page in renderer["PAGES"]:
        text = page.read_text()
        found += [name for _, name, _ in renderer["BLOCK"].findall(text)]
        assert renderer["rendered"](text) == text, "run docs/render_readme.py"
    assert {"results/table1", "results/demo", "results/circle", "results/replay", "results/lift_cup"} <= set(found)
    assert {
        "results/decode",
        "results/joints",
        "results/validity",
        "results/deltas",
        "results/elbow_angle",
        "results/panda8",
        "results/training_time",
    } <= set(found)


@pytest.mark.parametrize("name", [path.parent.name for path in sorted(ROOT.glob("results/*/results.json"))])
def test_the_grids_pages_are_rendered_from_their_results(name: str, tmp_path: Path) -> None:
    for path in (ROOT / "results" / name).glob("*"):
        if path.suffix in (".json", ".png"):
            shutil.copy(path, tmp_path)
    of_agents = MODES in json.loads((tmp_path / "results.json").read_text())["meta"]["grid"]
    (agents_page if of_agents else grid_page).write_pages(tmp_path)
    for page in ("README.md", "table.md"):
        assert (tmp_path / page).read_text() == (ROOT / "results" / name / page).read_text()


def test_every_task_is_in_the_tables_with_its_time() -> None:
    readme, page = (ROOT / "README.md").read_text(), (ROOT / "docs" / "tasks.md").read_text()
    for task in TASKS:
        rows = [line for line in readme.splitlines() if line.startswith(f"| `{task.task}`")]
        assert any(row.endswith(f"| {task.max_steps / RATE:g} s |") for row in rows)
        assert f"`{task.task}`" in page
        assert f"images/tasks/{task.task}.webp" in page
        assert (ROOT / "docs" / "images" / "tasks" / f"{task.task}.webp").stat().st_size < 200_000
