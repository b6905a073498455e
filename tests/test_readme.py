"""The README's tables are those of the results it names."""

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_the_readmes_tables_are_rendered_from_the_results() -> None:
    renderer = runpy.run_path(str(ROOT / "docs" / "render_readme.py"))
    text = (ROOT / "README.md").read_text()
    assert len(renderer["BLOCK"].findall(text)) >= 2
    assert renderer["rendered"](text) == text, "run docs/render_readme.py"
