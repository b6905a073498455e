"""Texts of the reports, rendered from the templates in ``er_il/report/templates``."""

import re

from jinja2 import Environment, PackageLoader, StrictUndefined

from er_il.support.counts import tally

_ENVIRONMENT = Environment(
    loader=PackageLoader("er_il.report"),
    autoescape=False,  # Markdown and plain text, not HTML
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
_ENVIRONMENT.filters |= {
    "percent": lambda value, digits=1: f"{value:.{digits}%}",
    "fixed": lambda value, digits: f"{value:.{digits}f}",
    "scientific": lambda value: f"{value:.0e}",
    "rates": lambda interval, digits=1: " – ".join(f"{bound:.{digits}%}" for bound in interval),
    "code": lambda names: ", ".join(f"`{name}`" for name in names),
    "tally": tally,
}


def render(template: str, **values: object) -> str:
    """Render a template; paragraphs are a blank line apart, whatever was left out between them."""
    text = _ENVIRONMENT.get_template(template).render(**values)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def sentences(template: str, **values: object) -> list[str]:
    """Render a template of sentences, one a line."""
    return [line for line in render(template, **values).splitlines() if line]
