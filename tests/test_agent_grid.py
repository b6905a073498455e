"""Experiments with agents: grids, their jobs and results, aggregates and figures."""

import csv
import gzip
import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from acting import SMALL
from documented import documented, run
from file_jobs import InOrder
from matplotlib.axes import Axes
from scipy.stats import trim_mean

from er_il.cli.benchmark import benchmark
from er_il.evaluation.aggregate import interquartile_mean, stratified_interval
from er_il.experiments.agents.grid import AgentCell, AgentGrid
from er_il.experiments.agents.plan import AgentPlan
from er_il.experiments.grid import Grid, GridError
from er_il.experiments.kinds import read_plan
from er_il.experiments.plan import Plan
from er_il.report.agents import invalid_figure, learning_figure, suite_figure
from er_il.rl.settings import Settings
from er_il.support.errors import ErIlError, UnknownNameError
from er_il.support.resources import data_dir

TINY = {
    "title": "Tiny",
    "tasks": {"reach_target": 64},
    "modes": ["joint", "task"],
    "training_seeds": [0],
    "episodes": 2,
}


PLACES = (("configs/", ".yaml"), ("outputs/benchmark/", ""), ("results/", ""))  # of a grid and what comes of it


def grid(**changes: Any) -> AgentGrid:
    return AgentGrid.from_dict(TINY | changes)


def test_the_shipped_grids_are_of_their_kinds(tmp_path: Path) -> None:
    folder = data_dir("configs")
    cells = {}
    for path in sorted(folder.glob("rl_*.yaml")):
        plan = read_plan(path, tmp_path)
        assert isinstance(plan, AgentPlan)
        cells[path.stem] = len(plan.jobs)
    assert cells == {"rl_full_body": 144, "rl_standard": 96, "rl_joints": 42, "rl_panda8": 36, "rl_time": 48}
    assert isinstance(read_plan(folder / "table1.yaml", tmp_path), Plan)
    with pytest.raises(GridError, match="There is no grid"):
        read_plan(tmp_path / "none.yaml", tmp_path)
    assert Grid is not AgentGrid


def test_mistakes_in_a_grid_are_named() -> None:
    with pytest.raises(UnknownNameError, match="Unknown mode 'osc'"):
        grid(modes=["osc"])
    with pytest.raises(UnknownNameError, match="Unknown task 'sweep'"):
        grid(tasks={"sweep": 10})
    with pytest.raises(GridError, match="modes names task twice"):
        grid(modes=["task", "task"])
    with pytest.raises(UnknownNameError, match="Unknown arm 'ur5'"):
        grid(arm="ur5")


def test_every_job_has_a_file_of_its_own(tmp_path: Path) -> None:
    varied = grid(
        modes=["erj", "erj@panda_joint3"], training_seeds=[0, 1], variants={"equal": {}, "paper": {"pace": "settled"}}
    )
    plan = AgentPlan(varied, tmp_path)
    jobs = [*plan.jobs, *(job.needs[0] for job in plan.jobs)]
    assert len({job.path for job in jobs}) == len({job.name for job in jobs}) == 2 * 2 * 2 * 2
    training = plan.training(AgentCell("reach_target", "erj", "paper"), 1)
    assert (training.environment, training.size, training.seed) == ({"pace": "settled"}, 64, 1)
    with plan.claimed():
        pass
    with pytest.raises(ErIlError, match="other variants named paper"):
        AgentPlan(grid(variants={"paper": {"pace": "equal"}}), tmp_path).check()
    with pytest.raises(ErIlError, match="learnt with other settings"):
        AgentPlan(grid(arm="panda8"), tmp_path).check()
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").touch()
    with pytest.raises(ErIlError, match="something else than an experiment"):
        AgentPlan(grid(), tmp_path / "thesis").check()


@pytest.mark.slow
@pytest.mark.usefixtures("small_films")
def test_a_grid_of_agents_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("er_il.support.workers.LocalExecutor", lambda workers: nullcontext(InOrder()))
    monkeypatch.setattr(Settings, "shipped", lambda pixels: SMALL)
    monkeypatch.setattr("er_il.envs.learning.DECISIONS", 40)  # of 200: films of these agents show nothing later on
    monkeypatch.chdir(tmp_path)
    file, out, results = (Path(f"{name}rl_full_body{suffix}") for name, suffix in PLACES)
    file.parent.mkdir()
    file.write_text(yaml.safe_dump(TINY))
    run("er-il", *documented("docs/reinforcement_learning.md", "er-il benchmark"))
    assert "reach_target task: 0 of 2 (2/2 cells)" in capsys.readouterr().out
    report = json.loads((results / "results.json").read_text())
    cells, meta = report["cells"], report["meta"]
    assert [(cell["decoder"], cell["successes"], cell["episodes"]) for cell in cells] == [
        ("joint", 0, 2),
        ("task", 0, 2),
    ]
    assert cells[1]["curve"] | {"steps": [64], "episodes": 1, "successes": [[0]]} == cells[1]["curve"]
    assert 0 <= cells[1]["curve"]["invalid_rates"][0][0] <= 1
    assert [each["decoder"] for each in report["suite"]] == ["joint", "task"] and report["suite"][0]["iqm"] == 0
    assert (meta["costs"]["trainings"], meta["costs"]["rollouts"], meta["missing"]) == (2, 4, [])
    assert meta["settings"] == SMALL.to_dict() and meta["computed_by"]
    rows = list(csv.DictReader(gzip.decompress((results / "episodes.csv.gz").read_bytes()).decode().splitlines()))
    assert [(row["decoder"], row["seed"]) for row in rows] == [
        (mode, str(1000 + i)) for mode in ("joint", "task") for i in (0, 1)
    ]
    page = (results / "README.md").read_text()
    for name in ("success.png", "learning.png", "invalid.png", "suite.png", "strip_reach_target.png"):
        assert f"({name})" in page and (results / name).stat().st_size > 5000
    assert not list(out.rglob("task.npz"))  # transitions are not kept
    before = {path: path.stat().st_mtime_ns for path in out.rglob("*.json") if path.name != "benchmark.json"}
    benchmark(file, out=out, results=results)  # all is there: it is only reported again
    assert before == {path: path.stat().st_mtime_ns for path in before}
    lost_report = (results / "results.json").read_text()
    lost = out / "agents/reach_target/task/64-steps-seed-0-2-episodes.json"
    lost.unlink()
    with AgentPlan(AgentGrid.from_file(file), out.resolve()).claimed():  # as if another command worked on it
        benchmark(file, out=out, results=tmp_path / "now", report_only=True)
    report = json.loads((tmp_path / "now/results.json").read_text())
    assert [cell["decoder"] for cell in report["cells"]] == ["joint"] and not lost.exists()
    assert report["meta"]["missing"] == [{"task": "reach_target", "decoder": "task"}]
    assert "reach_target task" in (tmp_path / "now/README.md").read_text()
    add_the_cells_of_another_folder(file, tmp_path / "elsewhere", tmp_path / "now", json.loads(lost_report))
    (out / "agents/reach_target/joint/64-steps-seed-0-2-episodes.json").unlink()
    with pytest.raises(ErIlError, match="None of the 2 cells is complete"):
        benchmark(file, out=out, results=tmp_path / "now", report_only=True)


def add_the_cells_of_another_folder(file: Path, out: Path, results: Path, all_here: Any) -> None:
    """A report without a cell gets it from a folder that has no other, and is the report of all in one folder."""
    published = json.loads((results / "results.json").read_text())
    benchmark(file, out=out, results=results, add=True)
    assert [path.name for path in (out / "agents/reach_target").iterdir()] == ["task"]  # the other was not run again
    report = json.loads((results / "results.json").read_text())
    assert report["cells"][0] == published["cells"][0] and report["meta"]["missing"] == []
    measured = {"decode_p50_ms", "decode_p99_ms", "costs"}
    for ours, theirs in zip(report["cells"], all_here["cells"], strict=True):
        assert {key: ours[key] for key in ours.keys() - measured} == {
            key: theirs[key] for key in theirs.keys() - measured
        }
    assert "difference_to_joint" in report["cells"][1] and report["suite"] == all_here["suite"]
    assert report["meta"]["costs"]["trainings"] == 2
    rows = gzip.decompress((results / "episodes.csv.gz").read_bytes())
    benchmark(file, out=out, results=results, add=True)  # the same again
    assert rows == gzip.decompress((results / "episodes.csv.gz").read_bytes()) and rows.count(b"\n") == 5


def test_a_report_that_cells_cannot_be_added_to_is_named(tmp_path: Path) -> None:
    file, results = tmp_path / "grid.yaml", tmp_path / "results"
    file.write_text(yaml.safe_dump(TINY))
    assert isinstance(plan := read_plan(file, tmp_path / "out", results), AgentPlan)  # of nothing so far
    assert len(plan.jobs) == 2
    curve = {"steps": [64], "episodes": 1, "successes": [[0]], "invalid_rates": [[0.0]]}
    cell = {"task": "reach_target", "decoder": "task", "episodes": 2, "per_seed": [], "curve": curve}
    meta = {"grid": grid().to_dict(), "settings": Settings.shipped(pixels=False).to_dict(), "computed_by": ["1f76b9b"]}

    def publish(rows: str, cell: dict[str, Any] = cell, **changes: Any) -> None:
        results.mkdir(exist_ok=True)
        (results / "results.json").write_text(json.dumps({"meta": meta | changes, "cells": [cell]}))
        (results / "episodes.csv.gz").write_bytes(gzip.compress(rows.encode()))

    head, row = "task,decoder,training_seed,seed,success,failure\n", "reach_target,task,0,{},1,\n"
    publish(head + row.format(1000) + row.format(1001))
    assert isinstance(plan := read_plan(file, tmp_path / "out", results), AgentPlan)
    assert [job.needs[0].mode for job in plan.jobs] == ["joint"]
    assert plan.published.reports[AgentCell("reach_target", "task")]["computed_by"] == ["1f76b9b"]
    for changed in ({"tasks": {"reach_target": 65}}, {"training_seeds": [1]}, {"episodes": 3}):  # asked for otherwise
        file.write_text(yaml.safe_dump(TINY | changed))
        assert isinstance(plan := read_plan(file, tmp_path / "out", results), AgentPlan)
        assert not plan.published.reports and len(plan.jobs) == 2
    file.write_text(yaml.safe_dump(TINY))
    publish(head + row.format(1000))
    with pytest.raises(ErIlError, match="does not hold the episodes of reach_target task"):
        read_plan(file, tmp_path / "out", results)
    publish(head, {})
    with pytest.raises(ErIlError, match=r"results\.json is damaged"):
        read_plan(file, tmp_path / "out", results)
    publish(head, settings=SMALL.to_dict())
    with pytest.raises(ErIlError, match="learnt with other settings"):
        read_plan(file, tmp_path / "out", results)
    publish(head)
    (results / "episodes.csv.gz").write_text("no archive")
    with pytest.raises(ErIlError, match=r"episodes\.csv\.gz is missing or damaged"):
        read_plan(file, tmp_path / "out", results)
    with pytest.raises(GridError, match="not a grid of agents"):
        read_plan(data_dir("configs") / "table1.yaml", tmp_path / "out", results)


def test_the_interquartile_mean_is_the_mean_of_the_middle_half() -> None:
    scores = np.random.default_rng(0).random((3, 8))
    assert interquartile_mean(scores) == pytest.approx(trim_mean(scores.ravel(), 0.25))
    assert interquartile_mean(np.array([[0.0, 0.5, 0.5, 1.0]])) == 0.5
    with pytest.raises(ErIlError, match="none of runs"):
        interquartile_mean(np.empty((0, 3)))


def test_its_interval_draws_trainings_task_by_task() -> None:
    apart = np.tile(np.linspace(0, 1, 8), (3, 1))  # tasks differ, trainings do not
    assert stratified_interval(apart) == pytest.approx((interquartile_mean(apart),) * 2)
    noisy = np.random.default_rng(0).random((10, 8))
    low, high = stratified_interval(noisy)
    assert low < interquartile_mean(noisy) < high and high - low < 0.3
    assert stratified_interval(noisy) == (low, high)
    many = stratified_interval(np.tile(noisy, (4, 1)))
    assert many[1] - many[0] < 0.7 * (high - low)


def lines(axis: Axes) -> list[list[float]]:
    return [list(map(float, line.get_ydata())) for line in axis.get_lines()]


def test_curves_show_every_seed_and_the_mean() -> None:
    curve = {
        "steps": [10, 20],
        "episodes": 20,
        "successes": [[0, 10], [10, 20]],
        "invalid_rates": [[0.5, 0.1], [0.3, 0.1]],
    }
    cells = [{"task": task, "decoder": "erj", "curve": curve} for task in ("reach_target", "stack_wine")]
    figure = learning_figure(cells)
    assert [axis.get_title(loc="left") for axis in figure.axes] == ["reach target", "stack wine"]
    assert lines(figure.axes[0]) == [[0, 50], [50, 100], [25, 75]]
    assert figure.axes[0].get_lines()[0].get_xdata() == pytest.approx([0.01, 0.02])  # in thousands
    assert lines(invalid_figure(cells).axes[0])[2] == pytest.approx([40, 10])
    axis = suite_figure([{"decoder": "erj", "iqm": 0.5, "interval": [0.4, 0.7]}]).axes[0]
    assert [tick.get_text() for tick in axis.get_yticklabels()] == ["ERJ"]
    bar = axis.patches[0]
    assert (bar.get_x(), bar.get_width()) == pytest.approx((40, 30))
