"""Reports and pictures: what is shown is what was counted."""

import json
import re
from pathlib import Path
from typing import Any

import av
import numpy as np
import pandas as pd
import pytest
from figures import assert_readable, bars, error_bars, legend_of, points, ticks
from matplotlib.image import imread
from PIL import Image

from er_il import Arm
from er_il.datasets.verification import CheckedEpisode, Verification
from er_il.report.charts import demonstrations_figure, success_figure
from er_il.report.films import PAUSE, WIDTH, Panel, moments, strip_figure, write_animation, write_film, write_strip
from er_il.report.grid_page import write_pages
from er_il.report.joints import joints_figure
from er_il.report.style import BAD, GOOD, LOOKS, OTHERS, looks_of
from er_il.report.tables import markdown_table, terminal_table
from er_il.report.text import sentences, table
from er_il.report.validity import validity_figure
from er_il.report.verification import verification_figure
from er_il.spaces.layout import Layout
from er_il.spaces.registry import make_arm_space

RESULTS = Path(__file__).resolve().parents[1] / "results"

CELLS = [
    {
        "task": "reach_cup",
        "decoder": decoder,
        "successes": successes,
        "episodes": 50,
        "interval": [low, high],
        "failures": failures,
        "invalid_rate": 0.125,
        "decode_p50_ms": 0.2,
        "decode_p99_ms": 0.9,
        "max_joint_step": 0.1234,
    }
    for decoder, successes, low, high, failures in [
        ("erj", 49, 0.894, 0.999, {"timeout": 1}),
        ("task-nearest", 0, 0.0, 0.071, {"collision": 48, "timeout": 2}),
    ]
]


def _success_table(cells: list[dict[str, Any]]) -> str:
    return markdown_table(table("success", cells=cells))


def pictures(count: int) -> list[np.ndarray]:
    return [np.full((48, 64, 3), 10 * i, dtype=np.uint8) for i in range(count)]


def test_the_table_holds_every_count() -> None:
    table = _success_table(CELLS).splitlines()
    assert len(table) == 2 + len(CELLS)
    assert "| `reach_cup` | erj | **49/50** | 89.4% – 99.9% | timeout 1 | 12.5% |" in table[2]
    assert "| `reach_cup` | task-nearest | **0/50** | 0.0% – 7.1% | collision 48, timeout 2 |" in table[3]


def test_a_replay_s_table_says_how_often_the_leader_succeeded() -> None:
    leader = {"starts": 51, "dropped": {"no plan": 1}}
    replayed = {**CELLS[0], "leader": leader, "max_joint_deviation": 0.0123}
    heading, _, row = _success_table([replayed]).splitlines()
    assert heading.startswith("| Task | Leader | Decoder |")
    assert "| 50/51, no plan 1 | erj |" in row
    assert "| 0.012 rad |" in row


def test_a_column_is_shown_where_a_cell_has_it() -> None:
    first, second = CELLS
    heading, _, one, other = _success_table([first, {**second, "elbow_error": 0.123}]).splitlines()
    assert heading.endswith("| Max. joint step | Mean elbow error |")
    assert one.endswith("| 0.123 rad | – |") and other.endswith("| 0.123 rad | 12.3 cm |")
    assert "Leader" not in heading and "Demonstrations" not in heading
    varied = [{**first, "demonstrations": count} for count in (4, 32)]
    assert "| erj | 32 | **49/50** |" in _success_table(varied).splitlines()[3]


def test_the_terminals_table_is_markdowns_without_its_marks() -> None:
    texts = pd.DataFrame({"`Name`": ["**a**"]})
    assert markdown_table(texts).splitlines() == ["| `Name` |", "| --- |", "| **a** |"]
    table = terminal_table(texts)
    assert [(column.header, list(column.cells)) for column in table.columns] == [("Name", ["a"])]


def test_bars_are_what_was_counted_with_their_intervals() -> None:
    figure = success_figure(CELLS, compared=True)
    (axis,) = figure.axes
    assert bars(axis) == {"ERJ": [98.0], "Task (nearest)": [0.0]}
    np.testing.assert_allclose(error_bars(axis), [[[89.4, 99.9]], [[0.0, 7.1]]])
    assert [text.get_text() for text in axis.texts] == ["49/50", "0/50"]
    assert ticks(axis) == ["reach cup"]
    (marks,) = [line for line in axis.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(np.asarray(marks.get_ydata(), dtype=float), [100, 0])  # the paper's ERJ and task space
    assert legend_of(figure) == ["ERJ", "Task (nearest)", "Paper, 10 rollouts on a real arm"]
    assert_readable(figure)
    assert legend_of(success_figure(CELLS)) == ["ERJ", "Task (nearest)"]


def test_bars_of_a_task_stand_beside_each_other_in_the_colours_of_their_decoders() -> None:
    cells = [{**cell, "task": task} for task in ("reach_cup", "a_task_of_ones_own") for cell in CELLS]
    (axis,) = success_figure(cells).axes
    places = [[bar.get_x() + bar.get_width() / 2 for bar in each.patches] for each in axis.containers[::2]]
    assert places == [pytest.approx([-0.2, 0.8]), pytest.approx([0.2, 1.2])]
    colours = [each.patches[0].get_facecolor() for each in axis.containers[::2]]
    assert len(set(colours)) == 2
    looks = looks_of(["joint", "erj@panda_joint2", "erj@panda_joint3"])
    assert [look.colour for look in looks.values()] == [LOOKS["joint"].colour, *OTHERS[:2]]


def test_curves_are_what_was_counted_with_their_intervals() -> None:
    few = [{**cell, "demonstrations": 4, "successes": 10, "interval": [0.1, 0.4]} for cell in CELLS]
    figure = demonstrations_figure([*({**cell, "demonstrations": 32} for cell in CELLS), *few])
    (axis,) = figure.axes
    found = points(axis)
    assert {name: values.tolist() for name, values in found.items()} == {"ERJ": [20, 98], "Task (nearest)": [20, 0]}
    np.testing.assert_allclose(error_bars(axis)[0], [[10, 40], [89.4, 99.9]])
    assert ticks(axis) == ["4", "32"] and axis.get_title(loc="left") == "reach cup"
    assert legend_of(figure) == ["ERJ", "Task (nearest)"]
    assert_readable(figure)


@pytest.mark.parametrize("name", ["table1", "images", "joint_training", "panda8"])
def test_the_published_figures_can_be_read(name: str) -> None:
    cells = json.loads((RESULTS / name / "results.json").read_text())["cells"]
    figure = success_figure(cells, compared=True)
    shown = [height for heights in bars(figure.axes[0]).values() for height in heights]
    assert sorted(shown) == pytest.approx(sorted(100 * cell["successes"] / cell["episodes"] for cell in cells))
    assert_readable(figure)


def test_the_figure_of_the_joint_study_shows_every_choice_and_set() -> None:
    report = json.loads((RESULTS / "joints" / "report.json").read_text())
    figure = joints_figure(report)
    motion, smallest, risk, missed, flips, training = figure.axes
    sets = {"workspace": report["workspace"], **report["demos"]}
    assert legend_of(figure) == list(sets)
    for axis, key, scale in ((motion, "self_motion", 1), (risk, "risk", 100), (missed, "missed", 100)):
        expected = {name: [scale * each[key] for each in of_set] for name, of_set in sets.items()}
        assert bars(axis) == {name: pytest.approx(values) for name, values in expected.items()}
    assert set(bars(flips)) == set(report["demos"])
    np.testing.assert_allclose(error_bars(smallest)[0][:, 0], [each["smallest_p05"] for each in report["workspace"]])
    for prediction, spread in zip(report["training"], error_bars(training), strict=True):
        rows = prediction["choices"]
        assert bars(training)[prediction["task"]] == pytest.approx([100 * row["success"] for row in rows])
        np.testing.assert_allclose(spread, [100 * np.array(row["interval"]) for row in rows], atol=1e-9)
    assert ticks(motion)[:2] == ["1\ntwists", "2\nbends"]
    assert_readable(figure)
    bare = joints_figure({**report, "demos": {}, "training": []})
    assert len([axis for axis in bare.axes if axis.axison]) == 4
    assert_readable(bare)


def test_the_figure_of_invalid_actions_shows_shares_causes_and_costs() -> None:
    report = json.loads((RESULTS / "validity" / "report.json").read_text())
    figure = validity_figure(report)
    curves, causes, decode = figure.axes[0], figure.axes[4], figure.axes[7]
    era = [
        cell
        for cell in report["cells"]
        if (cell["space"], cell["mode"], cell["around"], cell["damped"]) == ("era", "delta", "demos", True)
    ]
    np.testing.assert_allclose(points(curves)["ERA"], [100 * cell["invalid_rate"] for cell in era])
    np.testing.assert_allclose(error_bars(curves)[4], [100 * np.array(cell["interval"]) for cell in era], atol=1e-9)
    names = ("Task", "ERJ", "ERA", "ERX")
    assert set(points(curves)) == {f"{name}{end}" for name in names for end in ("", ", undamped")}
    totals = np.sum(list(bars(causes).values()), axis=0)
    pooled = [row for row in report["pooled"] if row["around"] == "demos" and row["damped"]]
    assert sorted(totals) == pytest.approx(sorted(100 * row["invalid_rate"] for row in pooled))
    lines = [line.get_ydata()[0] for line in decode.lines if len(line.get_xdata()) == 2]
    assert set(report["paper_ms"].values()) <= set(lines)
    assert_readable(figure)


def grid_folder(folder: Path, **grid: object) -> Path:
    """A folder with the results of a small grid."""
    report = json.loads((RESULTS / "images" / "results.json").read_text())
    report["meta"]["grid"] |= grid
    (folder / "results.json").write_text(json.dumps(report))
    return folder


def test_the_page_of_a_grid_shows_the_films_that_are_there(tmp_path: Path) -> None:
    write_pages(grid_folder(tmp_path, recording_seed=7))
    assert "## Films" not in (tmp_path / "README.md").read_text()
    assert "(recipe seed 7;" in (tmp_path / "README.md").read_text()
    for name in ("rollouts.webp", "erj.mp4", "erj.rrd", "joint.mp4", "strip_reach_cup.png"):
        (tmp_path / name).touch()
    write_pages(tmp_path)
    page = (tmp_path / "README.md").read_text()
    films = page.partition("## Films")[2].partition("##")[0]
    assert "](rollouts.webp)" in films
    assert "- joint: [film](joint.mp4)\n" in films
    assert "- erj: [film](erj.mp4), [Rerun recording](erj.rrd)\n" in films
    assert "task-nearest" not in films
    assert "![strip_reach_cup](strip_reach_cup.png)" in page


def test_a_grid_names_its_posture_baselines_or_as_version_0_1_its_sceptics(tmp_path: Path) -> None:
    grid = json.loads((RESULTS / "table1" / "results.json").read_text())
    (tmp_path / "results.json").write_text(json.dumps(grid))
    write_pages(tmp_path)
    page = (tmp_path / "README.md").read_text()
    assert "## Posture baselines" in page
    assert "sufficient on: `push_button_elbow` (`task-grasp`), `lift_cup` (`task-mean`, `task-grasp`)." in page
    assert "It is not sufficient on: `reach_cup`, `remove_cup`, `reach_remove_cup`, `retrieve_bear`." in page
    assert markdown_table(table("compact", **grid, decoders=["joint", "task-mean", "task-grasp"])) in page
    grid["meta"]["grid"]["sceptics"] = grid["meta"]["grid"].pop("posture_baselines")
    (tmp_path / "results.json").write_text(json.dumps(grid))
    write_pages(tmp_path)
    assert (tmp_path / "README.md").read_text() == page
    assert not re.search(r"\n\n\n|\{\{|\{%|Undefined", page)


def test_a_film_has_every_picture(tmp_path: Path) -> None:
    write_film(pictures(12), tmp_path / "new" / "film.mp4", rate=10)
    with av.open(str(tmp_path / "new" / "film.mp4")) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) == 12
    assert [frame.mean() for frame in frames] == pytest.approx([10 * i for i in range(12)], abs=4)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["film.mp4"]


def test_an_animation_plays_films_side_by_side_and_marks_how_each_ends(tmp_path: Path) -> None:
    long, short = tmp_path / "long.mp4", tmp_path / "short.mp4"
    write_film(pictures(9), long, rate=10)
    write_film(pictures(5), short, rate=10)
    panels = [Panel("ERJ", "success", True, long), Panel("Task", "collision", False, short)]
    write_animation(panels, tmp_path / "all.webp")
    greys, borders, times = [], [], []
    with Image.open(tmp_path / "all.webp") as animation:
        width, height = animation.size
        for at in range(animation.n_frames):
            animation.seek(at)
            picture = np.asarray(animation.convert("RGB")).astype(int)
            times.append(animation.info["duration"])
            greys.append([picture[height // 2, x].mean() for x in (WIDTH // 2, width - WIDTH // 2)])
            borders.append([np.ptp(picture[height // 2, x]) > 40 for x in (1, width - 2)])
    assert times == [100] * 8 + [PAUSE]
    assert np.array(greys) == pytest.approx(np.array([[10 * t, 10 * min(t, 4)] for t in range(9)]), abs=6)
    assert borders == [[t >= 8, t >= 4] for t in range(9)]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["all.webp", "long.mp4", "short.mp4"]


def test_moments_go_from_the_first_to_the_last() -> None:
    assert [int(picture.mean()) // 10 for picture in moments(pictures(9), 3)] == [0, 4, 8]
    assert len(moments(pictures(1), 3)) == 3


def test_a_strip_shows_every_film_from_its_first_to_its_last_picture(tmp_path: Path) -> None:
    long, short = tmp_path / "long.mp4", tmp_path / "short.mp4"
    write_film(pictures(10), long, rate=10)
    write_film(pictures(4), short, rate=10)
    panels = [Panel("erj", "success", True, long), Panel("task", "collision", False, short)]
    figure = strip_figure(panels, 4)
    shown = [np.mean(picture) for axis in figure.axes if (picture := axis.images[0].get_array()) is not None]
    assert shown == pytest.approx([0, 30, 60, 90, 0, 10, 20, 30], abs=4)
    for panel, line in zip(panels, (figure.axes[:4], figure.axes[4:]), strict=True):
        assert line[0].get_title(loc="left") == panel.title
        assert line[-1].get_title(loc="right") == panel.outcome
    outcomes = [axis._right_title for axis in (figure.axes[3], figure.axes[7])]
    assert [title.get_color() for title in outcomes] == [GOOD, BAD]
    write_strip(panels, 4, tmp_path / "strip.png")
    write_strip(panels[:1], 4, tmp_path / "one.png")
    strip, single = imread(tmp_path / "strip.png"), imread(tmp_path / "one.png")
    assert strip.shape[1] == single.shape[1]
    assert strip.shape[0] == pytest.approx(2 * single.shape[0], abs=2)


def verified(count: int) -> Verification:
    """Two episodes of an arm, the last frames of each flagged."""
    episodes = tuple(
        CheckedEpisode(
            number=number,
            status=np.full((count, 1), "ok"),
            error=np.full((count, 1), 1e-7) * np.arange(1, count + 1)[:, None],
            flagged=np.arange(count)[:, None] >= count - 3,
            conditioning=np.full((count, 1), 0.1 + number),
            position_error=np.zeros((count, 1)),
            rotation_error=np.zeros((count, 1)),
            broken=np.zeros((count, 1), dtype=bool),
        )
        for number in range(2)
    )
    layout = Layout.of_space(make_arm_space("erj", Arm.preset("panda")))
    return Verification(layout, episodes, compared=True, findings={}, other_side={}, problems={})


def test_the_figure_of_a_verification_tells_flagged_frames_apart() -> None:
    figure = verification_figure(verified(20), "a dataset")
    errors, conditioning = figure.axes
    shown = {str(line.get_label()): np.asarray(line.get_xdata(), dtype=int) for line in errors.lines}
    assert shown["flagged"].tolist() == [17, 18, 19, 37, 38, 39]
    assert sorted([*shown["not flagged"], *shown["flagged"]]) == list(range(40))
    values = {float(np.asarray(line.get_ydata())[0]) for line in conditioning.lines if len(line.get_xdata()) == 20}
    assert values == {0.1, 1.1}
    assert figure.get_suptitle() == "a dataset"
    assert_readable(figure)


def test_what_is_said_of_a_verification_names_frames_near_singularities_and_signs() -> None:
    near = [{"episode": i, "arm": "panda", "first": 4, "last": 9, "smallest": 0.01} for i in range(7)]
    report = {
        "invalid_by_episode": {3: {"unreachable": 2, "jump": 1}},
        "near_singularity": near,
        "arms": {"panda": {"quaternions_other_side": 0.25}},
    }
    said = sentences("verification.txt.j2", **report)
    assert said[0] == "Episode 3: unreachable 2, jump 1"
    assert said[1] == "Episode 0, panda: near a singularity in frames 4 to 9 (smallest singular value 1.0e-02)"
    assert len(said) == 8 and said[6] == "and 2 more in the report"
    assert said[7].startswith("panda: 25.0% of the quaternions are beyond their hemisphere")
