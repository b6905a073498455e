"""Reports and pictures: what is shown is what was counted."""

import json
from pathlib import Path

import av
import numpy as np
import pytest
from matplotlib.image import imread
from PIL import Image

from er_il.report.animation import PAUSE, WIDTH, Panel, write_animation
from er_il.report.pictures import Row, moments, write_film, write_strip
from er_il.report.success import CHART, success_table, write_page

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
META = {
    "git": "0123abc",
    "versions": {"python": "3.12"},
    "machine": {"processor": "a processor", "cores": 2},
    "rollouts": 50,
}


def pictures(count: int) -> list[np.ndarray]:
    return [np.full((48, 64, 3), 10 * i, dtype=np.uint8) for i in range(count)]


def test_the_table_holds_every_count() -> None:
    table = success_table(CELLS).splitlines()
    assert len(table) == 2 + len(CELLS)
    assert "| **49/50** | 89.4% – 99.9% | timeout 1 | 12.5% |" in table[2]
    assert "| **0/50** | 0.0% – 7.1% | collision 48, timeout 2 |" in table[3]


def test_a_replay_s_table_says_how_often_the_leader_succeeded() -> None:
    leader = {"starts": 51, "dropped": {"no plan": 1}}
    replayed = {**CELLS[0], "leader": leader, "max_joint_deviation": 0.0123}
    heading, _, row = success_table([replayed]).splitlines()
    assert heading.startswith("| Task | Leader | Decoder |")
    assert "| 50/51, no plan 1 | erj |" in row
    assert "| 0.012 rad |" in row


def test_the_page_is_rendered_from_the_json(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text(json.dumps({"meta": META, "cells": CELLS}))
    write_page(
        tmp_path, "A title", "What was done.", {"The strip": "strip.png", "All": "all.webp", "A film": "erj.mp4"}
    )
    page = (tmp_path / "report.md").read_text()
    for line in success_table(CELLS).splitlines():
        assert line in page
    for text in (
        "0123abc",
        "rollouts: 50",
        "![The strip](strip.png)",
        "![All](all.webp)",
        "[A film](erj.mp4)",
        f"]({CHART})",
    ):
        assert text in page
    assert imread(tmp_path / CHART).std() > 0.05


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
        for at in range(animation.n_frames):  # pyright: ignore[reportAttributeAccessIssue]
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


def test_a_strip_shows_every_row(tmp_path: Path) -> None:
    rows = [Row("erj", "success", True, pictures(4)), Row("task", "collision", False, pictures(4))]
    write_strip(rows, tmp_path / "strip.png")
    one_row = tmp_path / "one.png"
    write_strip(rows[:1], one_row)
    strip, single = imread(tmp_path / "strip.png"), imread(one_row)
    assert strip.shape[1] == single.shape[1]
    assert strip.shape[0] == pytest.approx(2 * single.shape[0], abs=2)
