"""What docs/tasks.md shows and says is what the tasks are."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from documented import ROOT, documented
from PIL import Image

from er_il.datasets.recipe import Recipe
from sim_tasks import TASKS
from sim_tasks.tasks.arm_task import RATE, ArmTask


@pytest.mark.slow
def test_a_tasks_picture_shows_its_demonstration(tmp_path: Path):
    (script,) = documented("docs/add_a_task.md", "python docs/render_tasks.py")
    render_tasks = runpy.run_path(str(ROOT / script))
    render_tasks["render"]("lift_cup", tmp_path / "new" / "lift_cup.webp")
    published = render_tasks["PICTURES"] / "lift_cup.webp"
    drawn, shown = (
        np.asarray(Image.open(path).convert("RGB")).astype(int)
        for path in (tmp_path / "new" / "lift_cup.webp", published)
    )
    assert np.abs(drawn - shown).mean() < 3
    moments = np.split(drawn[:, : 5 * 304 - 4], [304 * i for i in range(1, 5)], axis=1)
    assert np.abs(moments[0][:, :300] - moments[4][:, :300]).mean() > 5


@pytest.mark.parametrize("task", TASKS)
def test_the_page_says_how_long_and_how_much_varies(task: type[ArmTask]):
    sections = (ROOT / "docs" / "tasks.md").read_text().split("\n## ")
    (section,) = [each for each in sections if f"`{task.task}`" in each.splitlines()[0]]
    assert f"| {task.max_steps} steps ({task.max_steps / RATE:g} s) |" in section
    for key, sides in Recipe.load(task.task).randomisation.items():
        if isinstance(sides, list | tuple) and key not in ("speed_range", "closing_range"):
            assert f"{100 * sides[0]:g} × {100 * sides[1]:g} cm (`{key}`)" in section
