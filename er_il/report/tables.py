"""Tables of results in Markdown and in the terminal, rendered from the results' JSON alone."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby, product
from typing import Any

import pandas as pd
from rich.markup import escape
from rich.table import Table

from er_il.evaluation.results import REFERENCE
from er_il.evaluation.statistics import exact_interval
from er_il.report.text import sentences

Row = Mapping[str, Any]

NONE = "–"


def table(name: str, rows: Iterable[object], **values: object) -> pd.DataFrame:
    """Texts of a table; a column that is empty in every row is left out.

    Args:
        name: The template ``tables/<name>.j2``, which renders a row as lines ``heading | text``.
        rows: What the template calls ``row``, one after the other.
        values: What the template needs besides.
    """
    lines = [[line.split("|", 1) for line in sentences(f"tables/{name}.j2", row=row, **values)] for row in rows]
    texts = pd.DataFrame([{heading.strip(): text.strip() for heading, text in row} for row in lines])
    return texts.loc[:, (texts != "").any()].replace("", NONE)


def markdown_table(texts: pd.DataFrame) -> str:
    """Texts by heading as a Markdown table."""
    lines = [list(texts), ["---"] * len(texts.columns), *texts.to_numpy().tolist()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def terminal_table(texts: pd.DataFrame) -> Table:
    """Texts by heading as a table for the terminal, without Markdown's marks."""
    plain = texts.rename(columns=_plain).map(_plain)
    shown = Table(*plain, box=None, header_style="bold")
    for row in plain.itertuples(index=False):
        shown.add_row(*row)
    return shown


def joined(names: Sequence[str]) -> str:
    """Name of a choice of joints: ``panda_joint1``, or ``joint1 + joint3``."""
    return " + ".join(names)


def success_texts(cells: Sequence[Row]) -> pd.DataFrame:
    """Reported rollouts or replays, a row per cell: all that the cells have, the demonstrations where they vary."""
    varied = len({cell.get("demonstrations") for cell in cells}) > 1
    return table("success", cells, reference=REFERENCE, varied=varied)


def compact_table(report: Row, decoders: Sequence[str] = ()) -> str:
    """Successes with exact 95 % intervals, a row per task (and number of demonstrations) and a column per decoder.

    Args:
        report: Results of a grid.
        decoders: Columns; the grid's decoders without the posture baselines if empty.
    """
    grid = report["meta"]["grid"]
    cells = {(cell["task"], cell["demonstrations"], cell["decoder"]): cell for cell in report["cells"]}
    rows, varied = product(grid["tasks"], grid["demonstrations"]), len(grid["demonstrations"]) > 1
    return markdown_table(table("compact", rows, cells=cells, decoders=decoders or grid["decoders"], varied=varied))


def round_trips_table(report: Row) -> str:
    """Round-trip accuracy of each arm and space, with the causes of misses."""
    groups = groupby(report["round_trips"], key=lambda each: (each["arm"], each["space"]))
    rows, border = (list(group) for _, group in groups), report["meta"]["ill_conditioned"]
    return markdown_table(table("round_trips", rows, ill_conditioned=border, exact_interval=exact_interval))


def _plain(text: str) -> str:
    return escape(text.replace("**", "").replace("`", ""))
