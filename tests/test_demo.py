"""The demo end to end, small: demonstrations, trainings, rollouts, films, report; resumed."""

import json
import sys
from pathlib import Path

import pytest
from documented import documented

from er_il.cli import main
from er_il.experiments.grid import GridError, demo_grid
from er_il.support.errors import UnknownNameError

DECODERS = ("task-nearest", "task-posture")
SMALL = {"decoders": ",".join(DECODERS), "demonstrations": "2", "steps": "2", "rollouts": "2"}


def run(monkeypatch: pytest.MonkeyPatch, out: Path, **changes: str) -> None:
    options = [word for key, value in (SMALL | changes).items() for word in (f"--{key}", value)]
    monkeypatch.setattr(sys, "argv", ["er-il", *documented("README.md", "er-il demo"), "--out", str(out), *options])
    main()


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_the_demo_makes_its_report_and_does_nothing_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    run(monkeypatch, out)
    report = json.loads((out / "results.json").read_text())
    assert [(cell["decoder"], cell["episodes"]) for cell in report["cells"]] == [(name, 2) for name in DECODERS]
    assert report["meta"]["training_steps"] == {"task": 2}  # one policy through both decoders
    grid = report["meta"]["grid"]
    assert (grid["episodes"], grid["demonstrations"]) == (2, [1])
    page = (out / "README.md").read_text()
    for cell in report["cells"]:
        assert f"**{cell['successes']}/{cell['episodes']}**" in page
    made = ["table.png", "strip_reach_cup.png", "rollouts.webp", "episodes.csv.gz"]
    made += [f"{name}{suffix}" for name in DECODERS for suffix in (".mp4", ".rrd", ".npz")]
    for name in made:
        assert (out / name).stat().st_size > 100, name
    work = [*out.rglob("*.mp4"), *out.rglob("*.safetensors"), *out.rglob("*.parquet"), *out.rglob("1000-1001.json")]
    when = {path: path.stat().st_mtime_ns for path in work}
    run(monkeypatch, out)
    again = json.loads((out / "results.json").read_text())
    assert again["cells"] == report["cells"]
    assert {path: path.stat().st_mtime_ns for path in work} == when
    capsys.readouterr()
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch, out, seed="1")
    assert "holds another recipe's demonstrations; asked for is seed 1 instead of 0" in capsys.readouterr().err


def test_a_folder_with_something_else_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch, tmp_path)
    assert "holds something else" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_demo_trains_on_what_its_recipe_does_not_hold_out() -> None:
    grid = demo_grid("reach_cup", 3, ("joint", "era"), 50, None, None)
    recipe = grid.recipe("reach_cup")
    assert grid.demonstrations == (recipe.episodes - recipe.validation,) == (32,)
    assert (recipe.seed, grid.training_seeds) == (3, (3,))


def test_wrong_names_and_numbers_list_the_valid_ones() -> None:
    with pytest.raises(UnknownNameError, match=r"Unknown decoder 'task'. Valid: .*task-nearest"):
        demo_grid("reach_cup", 0, ("task",), 2, 2, 2)
    with pytest.raises(UnknownNameError, match=r"Unknown task 'cup'. Valid: .*reach_cup"):
        demo_grid("cup", 0, ("joint",), 2, 2, 2)
    with pytest.raises(GridError, match="rollouts is 0: Input should be greater than or equal to 1"):
        demo_grid("reach_cup", 0, ("joint",), 0, 2, 2)
