"""The page of an experiment with agents, rendered from a folder's ``results.json``."""

import json
from pathlib import Path

from er_il.evaluation.results import EPISODES, RESULTS
from er_il.report.agents import invalid_figure, learning_figure, suite_figure
from er_il.report.charts import success_figure
from er_il.report.grid_page import PAGE, TABLE
from er_il.report.style import save
from er_il.report.tables import markdown_table
from er_il.report.text import render, table


def write_pages(folder: Path) -> None:
    """Write the figures, the table and the page of a folder from its ``results.json``."""
    report = json.loads((folder / RESULTS).read_text())
    cells, suite = report["cells"], report["suite"]
    if not cells:
        return
    figures = {"success.png": success_figure(cells), "learning.png": learning_figure(cells)}
    figures |= {"invalid.png": invalid_figure(cells)} | ({"suite.png": suite_figure(suite)} if suite else {})
    for name, figure in figures.items():
        save(figure, folder / name)
    (folder / TABLE).write_text(markdown_table(table("success", **report)) + "\n")
    page = render(
        "agents.md.j2",
        meta=report["meta"],
        grid=report["meta"]["grid"],
        cells=cells,
        suite=suite,
        episodes=EPISODES,
        files=sorted(path.name for path in folder.iterdir()),
    )
    (folder / PAGE).write_text(page)
