"""Results in the terminal and on disk, as several commands show them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.table import Table

HEADINGS = ("Task", "Decoder", "Success", "95 % interval", "Failures", "Invalid actions")


def results_table(cells: Sequence[Mapping[str, Any]]) -> "Table":
    """Reported cells, one a row."""
    from er_il.report.tables import terminal_table
    from er_il.report.text import table

    return terminal_table(table("success", cells=cells).reindex(columns=list(HEADINGS)))


def write_study(
    report: dict[str, Any], out: Path, console: "Console", figures: "Mapping[str, Callable[[dict[str, Any]], Figure]]"
) -> None:
    """Write ``report.json`` and the figures, by file name, that are drawn from it; print their paths."""
    from er_il.report.style import save
    from er_il.support.atomic_files import write_json

    write_json(out / "report.json", report)
    for name, draw in figures.items():
        save(draw(report), out / name)
    for name in ("report.json", *figures):
        console.print(str(out / name), highlight=False, soft_wrap=True)
