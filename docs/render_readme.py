"""Render the pages' tables from the results they come from: ``uv run python docs/render_readme.py``.

A block between ``<!-- results/NAME -->`` and ``<!-- /results/NAME -->`` is the table of
``results/NAME/report.json``.
"""

import json
import re
from pathlib import Path

from er_il.showcase.circle import drift_table
from er_il.showcase.report import REPORT, success_table

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
BLOCK = re.compile(r"(<!-- (results/\w+) -->\n).*?(<!-- /\2 -->)", re.DOTALL)


def rendered(text: str) -> str:
    """Return the text with every results block filled from its file."""

    def table(block: re.Match[str]) -> str:
        report = json.loads((ROOT / block[2] / REPORT).read_text())
        rendered_table = drift_table(report) if "drives" in report else success_table(report["cells"])
        return f"{block[1]}{rendered_table}\n{block[3]}"

    return BLOCK.sub(table, text)


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(rendered(page.read_text()))
