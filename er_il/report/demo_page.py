"""The demo's page, rendered from its ``report.json``."""

import json
from collections.abc import Mapping
from pathlib import Path

from er_il.report.charts import success_figure
from er_il.report.style import save
from er_il.report.tables import success_table
from er_il.report.text import render

REPORT, CHART, PAGE = "report.json", "success.png", "report.md"
PICTURES = (".png", ".webp")  # shown on the page; other files are linked


def write_page(folder: Path, title: str, introduction: str, pictures: Mapping[str, str]) -> None:
    """Write ``report.md`` and the chart from ``report.json`` in a folder.

    Args:
        folder: Where ``report.json`` is and the page goes.
        title: Heading of the page.
        introduction: A paragraph.
        pictures: Caption to file name, relative to the folder; films become links.
    """
    report = json.loads((folder / REPORT).read_text())
    save(success_figure(report["cells"]), folder / CHART)
    table = success_table(report["cells"])
    values = {"meta": report["meta"], "table": table, "chart": CHART, "pictures": pictures, "shown": PICTURES}
    (folder / PAGE).write_text(render("demo.md.j2", title=title, introduction=introduction, **values))
