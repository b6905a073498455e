"""Results as a table in the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from er_il.support.counts import tally


def results_table(cells: Sequence[Mapping[str, Any]]) -> Table:
    """Show reported cells, one a row."""
    table = Table(box=None, header_style="bold")
    for heading in ("Task", "Decoder"):
        table.add_column(heading)
    for heading in ("Success", "95 % interval", "Invalid"):
        table.add_column(heading, justify="right")
    table.add_column("Failures")
    for cell in cells:
        low, high = cell["interval"]
        table.add_row(
            cell["task"],
            cell["decoder"],
            f"{cell['successes']}/{cell['episodes']}",
            f"{low:.1%} to {high:.1%}",
            f"{cell['invalid_rate']:.1%}",
            tally(cell["failures"]) or "none",
        )
    return table
