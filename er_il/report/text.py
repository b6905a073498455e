"""Texts of the reports, rendered from the templates in ``er_il/report/templates``."""

import re
from collections.abc import Mapping
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined

from er_il.evaluation.results import REFERENCE
from er_il.evaluation.statistics import exact_interval
from er_il.report import paper
from er_il.report.tables import markdown_table, read_rows
from er_il.support.counts import tally

Report = Mapping[str, Any]  # the JSON of a study or a grid, or a part of it

_ENVIRONMENT = Environment(
    loader=PackageLoader("er_il.report"),
    autoescape=False,  # Markdown and plain text, not HTML
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_ENVIRONMENT.globals |= {"reference": REFERENCE, "exact_interval": exact_interval, "paper": paper}
_ENVIRONMENT.filters |= {
    "percent": lambda value, digits=1: f"{value:.{digits}%}",
    "fixed": lambda value, digits: f"{value:.{digits}f}",
    "scientific": lambda value: f"{value:.0e}",
    "rates": lambda interval, digits=1: " – ".join(f"{bound:.{digits}%}" for bound in interval),
    "code": lambda names: ", ".join(f"`{name}`" for name in names),
    "markdown_table": lambda rows: markdown_table(read_rows(rows)),
    "tally": tally,
}


def render(template: str, **values: object) -> str:
    """Render a template; paragraphs are a blank line apart, whatever was left out between them."""
    text = _ENVIRONMENT.get_template(template).render(**values)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def sentences(template: str, **values: object) -> list[str]:
    """Render a template of sentences, one a line."""
    return [line for line in render(template, **values).splitlines() if line]


def table(name: str, **values: object) -> pd.DataFrame:
    """Texts by heading of the table ``templates/tables/<name>.j2``."""
    return read_rows(render(f"tables/{name}.j2", **values))
