"""Tables of texts, from the templates' rows to Markdown and the terminal."""

import re
from collections.abc import Sequence

import pandas as pd
from rich.markup import escape
from rich.table import Table

NONE = "–"


def read_rows(text: str) -> pd.DataFrame:
    """Texts by heading from rows a blank line apart, each of lines ``heading | text``.

    A column that is empty in every row is left out.
    """
    rows = [[line.split("|", 1) for line in row.splitlines()] for row in re.split(r"\n\s*\n", text.strip("\n"))]
    texts = pd.DataFrame([{heading.strip(): cell.strip() for heading, cell in row} for row in rows])
    return texts.loc[:, (texts != "").any()].replace("", NONE)


def markdown_table(texts: pd.DataFrame) -> str:
    """Texts by heading as a Markdown table."""
    heading, *rows = _lines(texts)
    return "\n".join(f"| {' | '.join(line)} |" for line in (heading, ["---"] * len(heading), *rows))


def terminal_table(texts: pd.DataFrame) -> Table:
    """Texts by heading as a table for the terminal, without Markdown's marks."""
    heading, *rows = ([escape(re.sub(r"\*\*|`", "", text)) for text in row] for row in _lines(texts))
    shown = Table(*heading, box=None, header_style="bold")
    for row in rows:
        shown.add_row(*row)
    return shown


def joined(names: Sequence[str]) -> str:
    """Name of a choice of joints: ``panda_joint1``, or ``joint1 + joint3``."""
    return " + ".join(names)


def _lines(texts: pd.DataFrame) -> list[list[str]]:
    return [list(texts), *texts.to_numpy().tolist()]  # pyrefly: ignore[bad-return]
