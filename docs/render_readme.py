"""Render the pages' tables from the results they come from: ``uv run python docs/render_readme.py``.

A block between ``<!-- results/NAME -->`` and ``<!-- /results/NAME -->`` is the table of
``results/NAME/report.json``, or the compact one of a benchmark's ``results/NAME/results.json``.
"""

import json
import re
from pathlib import Path

from er_il.evaluation.results import RESULTS
from er_il.report.joints import joints_table
from er_il.report.tables import compact_table, markdown_table, round_trips_table, success_texts, table
from er_il.report.validity import validity_table

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK = re.compile(r"(<!-- (results/\w+) -->\n).*?(<!-- /\2 -->)", re.DOTALL)

# How a report is shown, by a key that only such reports have.
TABLES = {
    "drives": lambda report: markdown_table(table("drift", report["drives"])),
    "pooled": validity_table,
    "workspace": joints_table,
    "drifts": lambda report: markdown_table(table("deltas", report["drifts"])),
    "round_trips": round_trips_table,
    "training_times": lambda report: markdown_table(table("training_time", report["training_times"])),
    "cells": lambda report: markdown_table(success_texts(report["cells"])),
}


def rendered(text: str) -> str:
    """Return the text with every results block filled from its file."""

    def filled(block: re.Match[str]) -> str:
        benchmark = ROOT / block[2] / RESULTS
        if benchmark.exists():
            return f"{block[1]}{compact_table(json.loads(benchmark.read_text()))}\n{block[3]}"
        report = json.loads((ROOT / block[2] / "report.json").read_text())
        return f"{block[1]}{next(table(report) for key, table in TABLES.items() if key in report)}\n{block[3]}"

    return BLOCK.sub(filled, text)


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(rendered(page.read_text()))
