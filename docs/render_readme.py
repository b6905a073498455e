"""Render the pages' tables from the results they come from: ``uv run python docs/render_readme.py``.

A block between ``<!-- results/NAME -->`` and ``<!-- /results/NAME -->`` is the table of
``results/NAME/report.json``, or the compact one of a benchmark's ``results/NAME/results.json``.
"""

import json
import re
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

from er_il.envs.decoders import DECODERS
from er_il.evaluation.results import RESULTS
from er_il.experiments.agents.grid import MODES
from er_il.report.joints import joints_table
from er_il.report.margins import margins_table
from er_il.report.tables import markdown_table
from er_il.report.text import table
from er_il.report.validity import validity_table

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK = re.compile(r"(<!-- (results/\w+) -->\n).*?(<!-- /\2 -->)", re.DOTALL)

# Template of a report's table, by a key that only such reports have.
TABLES = {
    "decodes": "decode",
    "drives": "drift",
    "drifts": "deltas",
    "elbow_angles": "elbow_angles",
    "round_trips": "round_trips",
    "training_times": "training_time",
    "environment_steps": "throughput",
    "kills": "faults",
    "decisions": "decisions",
    "replays": "replays",
    "cells": "success",
}


def shown(report: dict[str, Any]) -> str:
    """A report as Markdown."""
    if "workspace" in report:
        return joints_table(report)
    if "margins" in report:
        return margins_table(report)
    if "pooled" in report:
        return validity_table(report)
    if all("rewards" in cell for cell in report.get("cells", [{}])):  # of er-il replay
        cells = sorted(report["cells"], key=lambda cell: (cell["task"], list(DECODERS).index(cell["decoder"])))
        report = {"replays": {task: list(of_task) for task, of_task in groupby(cells, itemgetter("task"))}}
    return markdown_table(table(next(name for key, name in TABLES.items() if key in report), **report))


def rendered(text: str) -> str:
    """Return the text with every results block filled from its file."""

    def filled(block: re.Match[str]) -> str:
        grid, study = ROOT / block[2] / RESULTS, ROOT / block[2] / "report.json"
        if grid.exists():
            report = json.loads(grid.read_text())
            kind = "agents" if MODES in report["meta"]["grid"] else "compact"
            return f"{block[1]}{markdown_table(table(kind, **report))}\n{block[3]}"
        return f"{block[1]}{shown(json.loads(study.read_text()))}\n{block[3]}"

    return BLOCK.sub(filled, text)


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(rendered(page.read_text()))
