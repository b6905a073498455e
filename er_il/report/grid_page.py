"""The page of a grid: its figure, tables, films and provenance, rendered from a folder's ``results.json``."""

import json
from itertools import product
from pathlib import Path

from er_il.evaluation.results import EPISODES, RESULTS
from er_il.report import paper
from er_il.report.charts import demonstrations_figure, success_figure, widths_figure
from er_il.report.style import save
from er_il.report.tables import markdown_table
from er_il.report.text import render, table

TABLE, PAGE = "table.md", "README.md"


def write_pages(folder: Path) -> None:
    """Write the figure, the table and the page of a folder from its ``results.json``."""
    report = json.loads((folder / RESULTS).read_text())
    cells, grid = report["cells"], report["meta"]["grid"]
    if not cells:
        return
    few, wide = len(grid["demonstrations"]) > 1, len(grid.get("within", [])) > 1
    compared = grid["arm"] == paper.ARM and any(task in paper.SUCCESSES for task in grid["tasks"])
    varied = few or wide
    if varied:
        figure = demonstrations_figure(cells) if few else widths_figure(cells)
    else:
        figure = success_figure(cells, compared=compared)
    picture = "curves.png" if varied else "table.png"
    save(figure, folder / picture)
    (folder / TABLE).write_text(markdown_table(table("success", **report)) + "\n")
    page = render(
        "grid.md.j2",
        meta=report["meta"],
        grid=grid,
        cells=cells,
        figure=picture,
        compared=compared,
        marked=not varied and any(paper.share(*each) is not None for each in product(grid["tasks"], grid["decoders"])),
        # Version 0.1 wrote the posture baselines as sceptics.
        baselines=grid["posture_baselines"] if "posture_baselines" in grid else grid["sceptics"],
        episodes=EPISODES,
        files=sorted(path.name for path in folder.iterdir()),
    )
    (folder / PAGE).write_text(page)
