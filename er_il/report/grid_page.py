"""The page of a grid: its figure, tables, films and provenance, rendered from a folder's ``results.json``."""

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from er_il.evaluation.results import EPISODES, REFERENCE, RESULTS
from er_il.report import paper
from er_il.report.charts import demonstrations_figure, success_figure
from er_il.report.style import save
from er_il.report.tables import compact_table, markdown_table, success_texts
from er_il.report.text import render

TABLE, PAGE = "table.md", "README.md"
BARS, CURVES = "table.png", "curves.png"
STRIPS = "strip_*.png"  # one a task
ANIMATION = "rollouts.webp"
FILMS = {".mp4": "film", ".rrd": "Rerun recording"}  # of a decoder

MARGIN = 0.05  # a posture is sufficient if the paired difference to the reference is, at 95 %, above minus this

Report = Mapping[str, Any]


def write_pages(folder: Path) -> None:
    """Write the figure, the table and the page of a folder from its ``results.json``."""
    report = json.loads((folder / RESULTS).read_text())
    cells, grid = report["cells"], report["meta"]["grid"]
    if not cells:
        return
    varied = len(grid["demonstrations"]) > 1
    compared = grid["arm"] == paper.ARM and any(task in paper.SUCCESSES for task in grid["tasks"])
    marked = not varied and any(paper.share(*each) is not None for each in product(grid["tasks"], grid["decoders"]))
    figure = demonstrations_figure(cells) if varied else success_figure(cells, compared=compared)
    save(figure, folder / (CURVES if varied else BARS))
    every_cell = markdown_table(success_texts(cells))
    (folder / TABLE).write_text(every_cell + "\n")
    baselines = posture_baselines(grid)
    page = render(
        "grid.md.j2",
        meta=report["meta"],
        grid=grid,
        cells=cells,
        figure=CURVES if varied else BARS,
        compared=compared,
        marked=marked,
        paper=paper,
        reference=REFERENCE,
        episodes=EPISODES,
        margin=MARGIN,
        table=compact_table(report),
        every_cell=every_cell,
        baselines_table=compact_table(report, (REFERENCE, *baselines)) if baselines else "",
        sufficient=sufficient_postures(report) if baselines else {},
        strips=sorted(path.stem for path in folder.glob(STRIPS)),
        animation=ANIMATION if (folder / ANIMATION).exists() else "",
        films=_films(folder, [*grid["decoders"], *baselines]),
    )
    (folder / PAGE).write_text(page)


def posture_baselines(grid: Mapping[str, Any]) -> list[str]:
    """The decoders of task space with a posture from the demonstrations; version 0.1 wrote them as ``sceptics``."""
    return grid["posture_baselines"] if "posture_baselines" in grid else grid["sceptics"]


def sufficient_postures(report: Report) -> dict[str, list[str]]:
    """For each task with a paired difference: the posture baselines that do as well as the reference."""
    found: dict[str, list[str]] = {}
    for cell in report["cells"]:
        if cell["decoder"] in posture_baselines(report["meta"]["grid"]) and (
            difference := cell.get(f"difference_to_{REFERENCE}")
        ):
            names = found.setdefault(cell["task"], [])
            if difference["interval"][0] > -MARGIN:
                names.append(cell["decoder"])
    return found


def _films(folder: Path, decoders: list[str]) -> dict[str, dict[str, str]]:
    """Files in the folder by kind, of each decoder that was filmed."""
    found = {
        name: {kind: f"{name}{ending}" for ending, kind in FILMS.items() if (folder / f"{name}{ending}").exists()}
        for name in decoders
    }
    return {name: files for name, files in found.items() if files}
