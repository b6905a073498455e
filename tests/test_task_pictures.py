"""The pictures of docs/tasks.md are of the demonstrations."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from documented import ROOT, documented
from PIL import Image


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
