"""Texts of the reports, rendered from the templates in ``er_il/report/templates``."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

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
_ENVIRONMENT.globals |= {"reference": REFERENCE, "exact_interval": exact_interval, "paper": paper}  # pyrefly: ignore[bad-assignment]
_ENVIRONMENT.filters |= {
    "percent": lambda value, digits=1: f"{value:.{digits}%}",
    "fixed": lambda value, digits: f"{value:.{digits}f}",
    "scientific": lambda value: f"{value:.0e}",
    "rates": lambda interval, digits=1: " – ".join(f"{bound:.{digits}%}" for bound in interval),
    "code": lambda names: ", ".join(f"`{name}`" for name in names),  # pyrefly: ignore[not-iterable]
    "markdown_table": lambda rows: markdown_table(read_rows(rows)),  # pyrefly: ignore[bad-argument-type]
    "tally": tally,
    "offset": lambda T: offset_text(np.asarray(T)),
}


def offset_text(T: NDArray[np.float64]) -> str:
    """A transform (4, 4) as a translation in mm and a rotation by its axis and angle."""
    x, y, z = 1e3 * T[:3, 3]
    turn = Rotation.from_matrix(T[:3, :3]).as_rotvec(degrees=True)
    angle = float(np.linalg.norm(turn))
    axis = turn / angle if angle > 0.05 else turn
    about = f", {angle:.1f} degrees about ({axis[0]:.2f} {axis[1]:.2f} {axis[2]:.2f})" if angle > 0.05 else ""
    return f"{x:.1f} {y:.1f} {z:.1f} mm{about}"


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
