"""A benchmark: what a grid may say, what is counted, what is shown; and a tiny one from end to end."""

import csv
import gzip
import json
from collections import Counter
from contextlib import closing, nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from documented import documented, run, train_in_process
from file_jobs import InOrder
from matplotlib.image import imread

from er_il.arms.arm import Arm
from er_il.cli.benchmark import benchmark
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.evaluation.elbow import ElbowReference
from er_il.evaluation.posture_baselines import grasp_posture, mean_posture
from er_il.evaluation.results import as_csv, long_form, report_cells
from er_il.evaluation.rollout import Rollout
from er_il.experiments.films import telling_seed
from er_il.experiments.grid import Cell, Grid, GridError
from er_il.experiments.imitation import Imitation
from er_il.experiments.plan import Plan
from er_il.experiments.run import write_results
from er_il.experiments.schedule import Schedule
from er_il.policy.training import PRECISION
from er_il.report.grid_page import write_pages
from er_il.report.tables import markdown_table
from er_il.report.text import table
from er_il.support.errors import ErIlError, UnknownNameError

PANDA = Arm.preset("panda")
TINY = {
    "title": "Tiny",
    "tasks": ["reach_cup"],
    "decoders": ["joint", "task-nearest"],
    "demonstrations": [1],
    "training_seeds": [0],
    "rollouts": 2,
    "episodes": 2,
    "steps": 2,
}

TASK = "push_button_elbow"  # the shortest one


def grid(**changes: object) -> Grid:
    return Grid.from_dict(TINY | changes)


def test_mistakes_in_a_grid_name_the_valid_choices(tmp_path: Path) -> None:
    with pytest.raises(GridError, match=r"A grid has no task. Valid: title, tasks, decoders"):
        grid(task="reach_cup")
    with pytest.raises(GridError, match="The grid lacks tasks, rollouts"):
        Grid.from_dict({key: value for key, value in TINY.items() if key not in ("tasks", "rollouts")})
    with pytest.raises(UnknownNameError, match=r"Unknown task 'cup'. Valid: .*reach_cup"):
        grid(tasks=["cup"])
    with pytest.raises(UnknownNameError, match=r"Unknown decoder 'task'. Valid: .*task-nearest"):
        grid(decoders=["task"])
    with pytest.raises(UnknownNameError, match=r"Unknown posture baseline 'joint'. Valid: task-mean, task-grasp"):
        grid(posture_baselines=["joint"])
    with pytest.raises(GridError, match="list it under posture_baselines"):
        grid(decoders=["task-mean"])
    with pytest.raises(GridError, match="tasks is 'reach_cup': Input should be a valid tuple"):
        grid(tasks="reach_cup")
    with pytest.raises(GridError, match="training_seeds names 1 twice"):
        grid(training_seeds=[1, 1])
    with pytest.raises(GridError, match=r"decoders is \[\]: Tuple should have at least 1 item"):
        grid(decoders=[])
    with pytest.raises(GridError, match="rollouts is 0: Input should be greater than or equal to 1"):
        grid(rollouts=0)
    with pytest.raises(GridError, match=r"training_seeds.1 is -1: Input should be greater than or equal to 0"):
        grid(training_seeds=[0, -1])
    with pytest.raises(GridError, match="steps is True: Input should be a valid integer"):
        grid(steps=True)
    with pytest.raises(GridError, match="demonstrations holds 33, but the recipe of reach_cup has 32"):
        grid(demonstrations=[4, 33], episodes=None)
    with pytest.raises(UnknownNameError, match=r"Unknown configuration 'pixels'. Valid: images, images_small"):
        grid(configuration="pixels", cameras={"reach_cup": ["wrist"]})
    with pytest.raises(GridError, match="it lacks the cameras of reach_cup"):
        grid(configuration="images_small")
    with pytest.raises(GridError, match="it lacks configuration, one of images, images_small"):
        grid(cameras={"reach_cup": ["wrist"]})
    with pytest.raises(GridError, match="cameras names lift_cup, which the grid does not have"):
        grid(cameras={"lift_cup": ["wrist"]})
    with pytest.raises(GridError, match=r"cameras is \['wrist'\]: Input should be a valid dictionary"):
        grid(cameras=["wrist"])
    with pytest.raises(GridError, match=r"within is for tasks that place a cup: .*reach_cup.*; not for retrieve_bear"):
        grid(tasks=["retrieve_bear"], within=[0.1])
    with pytest.raises(GridError, match="varies either demonstrations or within, not both"):
        grid(demonstrations=[1, 2], episodes=3, within=[0.1])
    with pytest.raises(GridError, match=r"within.0 is 0.0: Input should be greater than 0"):
        grid(within=[0.0])
    with pytest.raises(GridError, match="There is no grid"):
        Grid.from_file(tmp_path / "none.yaml")
    (tmp_path / "grid.yaml").write_text(yaml.safe_dump(TINY | {"rollouts": "many"}))
    with pytest.raises(GridError, match=r"grid.yaml: rollouts is 'many': Input should be a valid integer"):
        Grid.from_file(tmp_path / "grid.yaml")


@pytest.mark.parametrize("name", ["demo", "table1", "data_efficiency", "images", "panda8", "relative", "extrapolation"])
def test_the_shipped_grids_are_grids(name: str) -> None:
    shipped = Grid.from_file(Path(__file__).parents[1] / "configs" / f"{name}.yaml")
    assert Grid.from_dict(shipped.to_dict()) == shipped
    assert "joint" in shipped.decoders  # the others are compared with it


def test_grids_of_version_0_1_0_are_read() -> None:
    assert grid(sceptics=["task-mean"]) == grid(posture_baselines=["task-mean"])
    results = json.loads((Path(__file__).parents[1] / "results/table1/results.json").read_text())
    assert Grid.from_dict(results["meta"]["grid"]).posture_baselines == ("task-mean", "task-grasp")


def test_jobs_differ_wherever_their_results_may(tmp_path: Path) -> None:
    wide = grid(
        decoders=["joint", "task-nearest", "task-posture"],
        training_seeds=[0, 1],
        rollouts=60,
        posture_baselines=["task-mean"],
    )
    jobs = Plan(wide, tmp_path).jobs
    assert len({job.path for job in jobs}) == len({job.name for job in jobs}) == len(jobs) == (3 * 2 + 1) * 3
    assert sorted((job.first_seed, job.size) for job in jobs[:3]) == [(1000, 25), (1025, 25), (1050, 10)]
    trained = {job.decoder: job.needs for job in jobs if job.needs[0].seed == 0}
    assert trained["task-nearest"] == trained["task-posture"] == trained["task-mean"] != trained["joint"]
    assert [job.decoder for job in jobs if job.needs[0].seed == 1].count("task-mean") == 0  # first seed only
    other = Plan(grid(steps=3), tmp_path).jobs
    assert not {job.path for job in other} & {job.path for job in jobs}


def test_rollouts_start_within_the_squares_that_a_grid_names(tmp_path: Path) -> None:
    plain, wide = grid(), grid(within=[0.03, 0.1])
    assert "within" not in plain.to_dict()  # as results of before there was that key have it
    assert Grid.from_dict(wide.to_dict()) == wide
    jobs = {cell: of_cell for cell, of_cell in Plan(wide, tmp_path).targets.items() if cell.decoder == "joint"}
    assert [cell.labels["within"] for cell in jobs] == [0.03, 0.1]
    narrow, broad = (of_cell[0] for of_cell in jobs.values())
    assert narrow.needs == broad.needs == Plan(plain, tmp_path).jobs[0].needs  # one policy
    assert len({narrow.path, broad.path, Plan(plain, tmp_path).jobs[0].path}) == 3
    assert broad.path.parent.name.endswith("-within-0.1") and broad.within == 0.1
    config = ErIlEnvConfig(task="reach_cup", action_space="joint", within=0.1)
    with closing(config.make()) as env:
        places = np.array([env.reset(seed=seed)[0]["environment_state"][:2] for seed in range(1000, 1012)])
    assert (np.ptp(places, axis=0) > 0.05).all() and (np.ptp(places, axis=0) < 0.1).all()
    with pytest.raises(ErIlError, match="push_button_elbow places no cup"):
        ErIlEnvConfig(task=TASK, within=0.1)


def test_each_square_is_a_cell_of_its_own_in_results(tmp_path: Path) -> None:
    outcomes = {(0.03, "joint"): "ooo", (0.03, "erj"): "oox", (0.1, "joint"): "oxx", (0.1, "erj"): "oox"}
    rollouts = long_form(
        (
            {"task": "reach_cup", "decoder": decoder, "demonstrations": 32, "training_seed": 0, "within": width},
            [
                Rollout(i, o == "o", "" if o == "o" else "collision", Counter(ok=1), (1e-3,), 0.1)
                for i, o in enumerate(of)
            ],
        )
        for (width, decoder), of in outcomes.items()
    )
    cells = report_cells(rollouts)
    assert [(each["within"], each["decoder"], each["successes"]) for each in cells] == [
        (width, decoder, of.count("o")) for (width, decoder), of in outcomes.items()
    ]
    assert cells[3]["difference_to_joint"]["difference"] == pytest.approx(1 / 3)  # to joint in the same square
    header, first, *_ = as_csv(rollouts).splitlines()
    assert header.startswith("within,task,") and first.startswith("0.030000,reach_cup,joint,32,0,0,1,")
    assert as_csv(cell("joint", "o")).startswith("task,decoder,")
    values = report()
    values["cells"], grid_of = cells, values["meta"]["grid"]
    grid_of |= {"decoders": ["joint", "erj"], "posture_baselines": [], "within": [0.03, 0.1]}
    (tmp_path / "results.json").write_text(json.dumps(values))
    write_pages(tmp_path)
    page = (tmp_path / "README.md").read_text()
    assert "| `reach_cup` | 10 cm | **1/3**" in page and "in a square of the given width" in page
    drawn = imread(tmp_path / "curves.png")
    values["cells"][3]["successes"] = 0
    (tmp_path / "results.json").write_text(json.dumps(values))
    write_pages(tmp_path)
    assert (imread(tmp_path / "curves.png") != drawn).any()


def test_images_are_recorded_and_learnt_from_where_a_grid_says_so(tmp_path: Path) -> None:
    seeing = grid(configuration="images_small", cameras={"reach_cup": ["wrist"]})
    assert Grid.from_dict(seeing.to_dict()) == seeing
    assert (seeing.recipe("reach_cup").cameras, grid().recipe("reach_cup").cameras) == (("wrist",), ())
    assert len(Schedule([*Plan(seeing, tmp_path).jobs, *Plan(grid(), tmp_path).jobs]).jobs) == 10  # none is shared
    claim(seeing, tmp_path / "mine")
    with pytest.raises(ErIlError, match="trained by other configurations than today's, of joint, task"):
        claim(grid(), tmp_path / "mine")


def test_a_grid_without_the_reference_is_reported_without_differences(tmp_path: Path) -> None:
    assert write_results(Imitation(Plan(grid(decoders=["erj"]), tmp_path)), tmp_path)["cells"] == []


def test_a_folder_holds_experiments_of_one_configuration(tmp_path: Path) -> None:
    (tmp_path / "strange").mkdir()
    (tmp_path / "strange" / "thesis.tex").touch()
    (tmp_path / "killed").mkdir()
    (tmp_path / "killed" / "benchmark.partial-0123abcd.json").touch()  # a kill as it said whose the folder is
    claim(grid(), tmp_path / "killed")
    with pytest.raises(ErIlError, match="something else than an experiment"):
        claim(grid(), tmp_path / "strange")
    claim(grid(), tmp_path / "mine")
    claim(grid(decoders=["joint", "erj"], rollouts=9), tmp_path / "mine")  # it may grow
    claim(grid(title="Other", demonstrations=[1]), tmp_path / "mine")  # what both have in common is done once
    shared = [{job.path for job in Plan(grid(title=title), tmp_path / "mine").jobs} for title in ("Tiny", "Other")]
    assert shared[0] == shared[1]
    owner = tmp_path / "mine" / "benchmark.json"
    found = json.loads(owner.read_text())
    found["configurations"]["erj"]["policy"]["dim_model"] = 7
    owner.write_text(json.dumps(found))
    with pytest.raises(ErIlError, match="trained by other configurations than today's, of erj"):
        claim(grid(decoders=["erj"]), tmp_path / "mine")
    with Plan(grid(), tmp_path / "busy").claimed():
        before = (tmp_path / "busy" / "benchmark.json").read_text()
        with pytest.raises(ErIlError, match="Another command works in"):
            claim(grid(decoders=["era"]), tmp_path / "busy")
        assert (tmp_path / "busy" / "benchmark.json").read_text() == before


def claim(of_grid: Grid, folder: Path) -> None:
    with Plan(of_grid, folder).claimed():
        pass


def cell(decoder: str, *outcomes: str) -> pd.DataFrame:
    """Rollouts of a policy a training seed, from an outcome each: o succeeds, x collides."""
    return long_form(
        (
            {"task": "reach_cup", "decoder": decoder, "demonstrations": 32, "training_seed": seed},
            [
                Rollout(1000 + i, o == "o", "" if o == "o" else "collision", Counter(ok=2), (1e-3, 2e-3), 0.1, 0.01 * i)
                for i, o in enumerate(of_seed)
            ],
        )
        for seed, of_seed in enumerate(outcomes)
    )


def test_a_cell_is_pooled_over_training_seeds_and_paired_by_them() -> None:
    joint, erj = cell("joint", "oooo", "ooox"), cell("erj", "oxoo", "oooo")
    reference, report = report_cells(pd.concat([joint, erj]))
    assert (report["successes"], report["episodes"], report["demonstrations"]) == (7, 8, 32)
    assert report["interval"] == pytest.approx([0.4735, 0.9968], abs=1e-4)
    assert [(each["training_seed"], each["successes"], each["episodes"]) for each in report["per_seed"]] == [
        (0, 3, 4),
        (1, 4, 4),
    ]
    paired = report["difference_to_joint"]
    assert paired["difference"] == 0.0  # one pair better, one worse
    assert paired["interval"] == pytest.approx([-0.3921, 0.3921], abs=1e-3)
    assert report["elbow_error"] == pytest.approx(0.015)
    assert reference["successes"] == 7 and "difference_to_joint" not in reference
    _, first_seed_only = report_cells(pd.concat([joint, cell("task-mean", "xooo")]))
    assert first_seed_only["difference_to_joint"]["difference"] == -0.25
    (alone,) = report_cells(erj)
    assert "difference_to_joint" not in alone


def test_the_filmed_start_is_where_task_space_collides_and_the_others_succeed() -> None:
    rollouts = pd.concat([cell("joint", "oxoo"), cell("erj", "ooox"), cell("task-nearest", "oxxx")])
    assert telling_seed(rollouts) == 1002


def test_postures_of_the_demonstrations() -> None:
    joints = np.arange(12.0).reshape(6, 2)
    taking = np.column_stack([joints, [1, 1, 0, 1, 0, 0]])  # lets go once, and takes again in row 4
    pressing = np.column_stack([joints, np.ones(6)])
    assert grasp_posture([taking]) == pytest.approx(joints[4])
    assert grasp_posture([taking, pressing]) == pytest.approx((joints[4] + joints[5]) / 2)
    assert mean_posture([taking, pressing[:2]]) == pytest.approx(np.vstack([joints, joints[:2]]).mean(axis=0))


def test_the_elbow_is_compared_where_the_hand_is_and_when_it_is_there() -> None:
    start, swing = np.array(PANDA.home), np.zeros(7)
    swing[0] = 0.5
    demo = start + np.linspace(0, 1, 21)[:, None] * swing
    reference = ElbowReference.of_demos(PANDA, 0.05, [demo])
    assert reference is not None
    assert reference.error(demo[::2]) < 0.02  # the same way at twice the speed
    turned = np.repeat(start[None], 5, axis=0)
    turned[:, 0] += 0.5
    radius = np.hypot(*reference.elbows[0][:2])
    assert reference.error(demo[:1]) == pytest.approx(0.0, abs=1e-9)
    assert reference.error(turned[:1]) == pytest.approx(0.0, abs=0.01)  # the demonstration was there, too, later
    folded = start.copy()
    folded[[0, 2]] = [0.8, -0.8]  # the hand not far from home, the elbow aside
    assert reference.error(folded[None]) > 0.2 * radius


def report(successes: int = 150) -> dict[str, Any]:
    """The report of a grid of one task, all by one seed."""
    shapes = [("joint", 200), ("erj", 199), ("task-nearest", 3), ("task-grasp", successes)]
    cells = report_cells(pd.concat([cell(name, "o" * count + "x" * (200 - count)) for name, count in shapes]))
    values = TINY | {"decoders": ["joint", "erj", "task-nearest"], "posture_baselines": ["task-grasp"]}
    values |= {"demonstrations": [32]}
    meta = {
        "versions": {"python": "3.12"},
        "machine": {"processor": "a processor", "cores": 2},
        "title": "A title",
        "grid": Grid.from_dict(values | {"episodes": None}).to_dict(),
        "computed_by": ["0123abc"],
        "training_steps": {"joint": 1500},
        "mixed_precision": ["bf16"],
        "rollout_seeds": "1000 to 1199",
        "costs": {"trainings": 3, "training_cpu_s": 3600, "rollouts": 800, "rollout_cpu_s": 1800},
        "missing": [],
    }
    return {"meta": meta, "cells": cells}


def test_the_page_shows_what_was_counted(tmp_path: Path) -> None:
    (tmp_path / "results.json").write_text(json.dumps(report()))
    (tmp_path / "strip_reach_cup.png").touch()
    write_pages(tmp_path)
    page = (tmp_path / "README.md").read_text()
    row = "| `reach_cup` | **200/200** (98.2% – 100.0%) | **199/200** (97.2% – 100.0%) | **3/200** (0.3% – 4.3%) |"
    assert row in markdown_table(table("compact", **report())) and row in page
    assert (tmp_path / "table.md").read_text() in page + "\n"
    assert "| collision 197 |" in page and "-98.5 (" in page
    for text in ("A title", "0123abc", "strip_reach_cup.png", "(table.png)", "training: bf16", "1.0 h", "0.5 h"):
        assert text in page
    assert "200 rollouts per cell instead of 10" in page
    assert "It is not sufficient on: `reach_cup`" in page
    drawn = imread(tmp_path / "table.png")
    values = report(successes=200)
    values["meta"]["grid"]["sceptics"] = values["meta"]["grid"].pop("posture_baselines")  # as in version 0.1.0
    (tmp_path / "results.json").write_text(json.dumps(values))
    write_pages(tmp_path)
    assert "A fixed posture is sufficient on: `reach_cup` (`task-grasp`)" in (tmp_path / "README.md").read_text()
    assert (imread(tmp_path / "table.png") != drawn).any()  # drawn from the counts; test_report reads the bars


def test_several_numbers_of_demonstrations_are_drawn_as_curves(tmp_path: Path) -> None:
    values = report()
    few = [each | {"demonstrations": 4, "successes": 40, "interval": [0.15, 0.3]} for each in values["cells"]]
    values["cells"] = [*few, *values["cells"]]
    values["meta"]["grid"]["demonstrations"] = [4, 32]
    (tmp_path / "results.json").write_text(json.dumps(values))
    write_pages(tmp_path)
    assert "| `reach_cup` | 4 | **40/200**" in (tmp_path / "README.md").read_text()
    drawn = imread(tmp_path / "curves.png")
    values["cells"][0]["successes"] = 150
    (tmp_path / "results.json").write_text(json.dumps(values))
    write_pages(tmp_path)
    assert (imread(tmp_path / "curves.png") != drawn).any()  # drawn from the counts; test_report reads the curves
    assert not (tmp_path / "table.png").exists()


def written(folder: Path) -> dict[Path, int]:
    """Demonstrations, policies and rollouts, and when they were written."""
    found = (path for pattern in ("*.parquet", "*.safetensors", "1000-*.json") for path in folder.rglob(pattern))
    return {path: path.stat().st_mtime_ns for path in found}


@pytest.mark.slow
@pytest.mark.usefixtures("quiet_logging", "small_films")
def test_a_grid_from_end_to_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # All in this process, which imports LeRobot once; test_demo has workers and trains in processes of their own.
    monkeypatch.setattr("er_il.support.workers.LocalExecutor", lambda workers: nullcontext(InOrder()))
    train_in_process(monkeypatch)
    monkeypatch.chdir(tmp_path)
    short = {"tasks": [TASK]}
    file, results = Path("configs/table1.yaml"), Path("results/table1")  # where the documented command looks
    out = Path("outputs/benchmark/table1").resolve()
    file.parent.mkdir()
    file.write_text(yaml.safe_dump(TINY | short))
    claim(grid(**short), out)
    in_the_way = Plan(grid(**short), out).training(Cell(TASK, "task-nearest", 1), 0).path.with_suffix("") / "thesis.tex"
    in_the_way.parent.mkdir(parents=True)
    in_the_way.touch()

    with pytest.raises(SystemExit, match="1"):  # one cell fails, is told, and does not stop the other
        benchmark(file, out=out, results=results)
    assert f"Failed: train {TASK} task" in " ".join(capsys.readouterr().out.split())
    first = json.loads((results / "results.json").read_text())
    assert [(each["decoder"], each["episodes"]) for each in first["cells"]] == [("joint", 2)]
    assert [each["decoder"] for each in first["meta"]["missing"]] == ["task-nearest"]

    in_the_way.unlink()
    before = written(out)
    grown = Plan(grid(posture_baselines=["task-grasp"], **short), out)
    monkeypatch.setenv(PRECISION, "bf16")
    executor = InOrder()
    schedule = Schedule(grown.jobs)
    schedule.run(executor)
    assert not schedule.failed
    assert [name.split()[:3] for name in executor.ran] == [  # neither demonstrations nor joint once more
        ["train", TASK, "task"],
        ["roll", "out", "task-nearest"],
        ["roll", "out", "task-grasp"],
    ]
    assert before.items() <= written(out).items()
    report = write_results(Imitation(grown), results)
    rows = list(csv.DictReader(gzip.decompress((results / "episodes.csv.gz").read_bytes()).decode().splitlines()))
    assert [(row["decoder"], row["training_seed"], row["seed"]) for row in rows] == [
        (name, "0", seed) for name in ("joint", "task-nearest", "task-grasp") for seed in ("1000", "1001")
    ]
    for each in report["cells"]:
        own = [row for row in rows if row["decoder"] == each["decoder"]]
        assert each["successes"] == sum(int(row["success"]) for row in own)
        assert each["mean_steps"] == np.mean([int(row["steps"]) for row in own])
        assert each["elbow_error"] == pytest.approx(np.mean([float(row["elbow_error"]) for row in own]), abs=1e-6)
    nearest, grasp = report["cells"][1:]
    assert nearest["elbow_error"] != grasp["elbow_error"]  # the posture reached the decoder
    assert report["meta"]["mixed_precision"] == ["bf16", "no"]
    costs = report["meta"]["costs"]
    assert (costs["trainings"], costs["rollouts"]) == (2, 6) and min(
        costs["training_cpu_s"], costs["rollout_cpu_s"]
    ) > 0

    table = (results / "episodes.csv.gz").read_bytes()
    run("er-il", *documented("docs/table.md", "er-il benchmark"))  # all is there: it is only reported again
    assert "2/2 cells" in capsys.readouterr().out
    strip = results / f"strip_{TASK}.png"
    for row in np.split(imread(strip)[: imread(strip).shape[0] // 2 * 2], 2):  # one of each decoder
        width = row.shape[1] // 5
        first, second, last = (row[row.shape[0] // 2 :, at * width :][:, :width] for at in (0, 1, 4))
        assert 0 < np.abs(second - first).mean() < np.abs(last - first).mean()  # the arm moves away
    assert strip.stat().st_size < 400_000
    assert len(table) > len((results / "episodes.csv.gz").read_bytes())
    write_results(Imitation(grown), results)
    assert (results / "episodes.csv.gz").read_bytes() == table
