"""The round trips of all arms as Markdown, rendered from the report of ``benchmarks/round_trip.py`` alone."""

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from er_il.evaluation.statistics import exact_interval
from er_il.report.markdown import markdown_table

Report = Mapping[str, Any]


def round_trips_table(report: Report) -> str:
    """A row an arm and space: what the action commands, how many configurations come back, why others do not."""
    rows = report["round_trips"]
    errors = list(dict.fromkeys(row["seed_error"] for row in rows))
    headings = ["Arm", "Joints", "Space", "Commands", *(f"Back, seed ± {error:g} rad" for error in errors)]
    headings += [f"Why not, at ± {errors[0]:g} rad", "Away from singularities"]
    border = report["meta"]["ill_conditioned"]
    lines = []
    for (arm, space), group in groupby(rows, key=lambda row: (row["arm"], row["space"])):
        cells = {row["seed_error"]: row for row in group}
        first = cells[errors[0]]
        shares = [_share(cells[error]) for error in errors]
        lines.append(
            [
                arm,
                str(first["joints"]),
                space,
                ", ".join(first["commands"]),
                *shares,
                _causes(first),
                _others(first, border),
            ]
        )
    return markdown_table(headings, lines)


def _share(row: Report) -> str:
    low, high = exact_interval(row["exact"], row["samples"])
    return f"**{row['exact'] / row['samples']:.1%}** ({low:.1%} – {high:.1%})"


def _others(row: Report, border: float) -> str:
    """Whether all configurations came back whose smallest singular value is above the border."""
    best = row["best_conditioned_miss"]
    count = row["samples"] - row["ill_conditioned_samples"]
    return f"all {count}" if best is None or best < border else f"not all {count}"


def _causes(row: Report) -> str:
    return ", ".join(f"{cause} {count}" for cause, count in row["causes"].items() if count) or "–"
