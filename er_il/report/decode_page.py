"""The page of the decoding benchmark, rendered from a folder's ``report.json``."""

import json
from pathlib import Path

from er_il.report.text import render


def write_page(folder: Path) -> None:
    """Write the page of a folder from its ``report.json``."""
    report = json.loads((folder / "report.json").read_text())
    (folder / "README.md").write_text(render("decode.md.j2", **report))
