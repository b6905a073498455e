"""The main job end to end, small: demonstrations, trainings, rollouts, report; interrupted and resumed."""

import json
import sys
from pathlib import Path

import pytest
from documented import documented
from rich.progress import Progress

from er_il.cli import main
from er_il.experiments.demo import Demo
from er_il.support.errors import ErIlError, UnknownNameError


def small(out: Path, **kwargs: object) -> Demo:
    options = {"decoders": ("erj", "task-nearest"), "demonstrations": 2, "steps": 2, "rollouts": 2} | kwargs
    return Demo(out, **options)  # pyright: ignore[reportArgumentType]


@pytest.mark.slow
def test_the_demo_makes_its_report_and_does_nothing_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "demo"
    options = ["--decoders", "erj,task-nearest", "--demonstrations", "2", "--steps", "2", "--rollouts", "2"]
    monkeypatch.setattr(sys, "argv", ["er-il", *documented("README.md", "er-il demo"), "--out", str(out), *options])
    main()
    report = json.loads((out / "report.json").read_text())
    assert [(cell["decoder"], cell["episodes"]) for cell in report["cells"]] == [("erj", 2), ("task-nearest", 2)]
    assert report["meta"]["training_steps"] == 2
    assert report["meta"]["demonstrations"] == 2
    page = (out / "report.md").read_text()
    for cell in report["cells"]:
        assert f"**{cell['successes']}/{cell['episodes']}**" in page
    made = ["success.png", "strip.png", "rollouts.webp", "episodes.csv"]
    made += [f"{name}{suffix}" for name in ("erj", "task-nearest") for suffix in (".mp4", ".rrd", ".npz")]
    for name in made:
        assert (out / name).stat().st_size > 100, name
    when = {path: path.stat().st_mtime_ns for path in out.rglob("*.mp4")} | {
        path: path.stat().st_mtime_ns for path in (out / "policies").rglob("*.safetensors")
    }
    with Progress(disable=True) as progress:
        cells = small(out).run(progress, workers=2)
    assert [cell.report() for cell in cells] == report["cells"]
    assert all(path.stat().st_mtime_ns == at for path, at in when.items())
    with pytest.raises(ErIlError, match="holds a demo with seed 0, not 1"):
        small(out, seed=1).claim()


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ErIlError, match="holds something else than a demo"):
        small(tmp_path).claim()
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_wrong_names_and_numbers_list_the_valid_ones(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match=r"Unknown decoder 'task'. Valid: .*task-nearest"):
        small(tmp_path, decoders=("task",))
    with pytest.raises(UnknownNameError, match=r"Unknown task 'cup'. Valid: .*reach_cup"):
        small(tmp_path, task="cup")
    with pytest.raises(ErIlError, match="0 rollouts"):
        small(tmp_path, rollouts=0)
