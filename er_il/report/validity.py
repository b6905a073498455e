"""The study of invalid actions: its figure, its table and its findings, rendered from its report alone."""

import itertools
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from er_il.evaluation.statistics import exact_interval
from er_il.report.charts import bar_chart, curve_chart, percent_axis, where
from er_il.report.style import BLUE, DOTTED, GREY, INK, LOOKS, RED, SKY, YELLOW, Look, label_of, styled
from er_il.report.tables import markdown_table
from er_il.report.text import Report, sentences, table

SPACES = ("task", "erj", "era", "erx")
AROUND = {"demos": "demonstrations", "random": "random states"}
UNDAMPED = ", undamped"
CAUSES = {
    "unreachable": Look("unreachable", BLUE),
    "limit": Look("joint limit", SKY),
    "jump": Look("jump", RED),
    "not_converged": Look("not converged", YELLOW),
    "invalid": Look("other", GREY),
}
SOLVERS = {True: Look("damped", BLUE), False: Look("undamped", SKY)}
CURVES = {
    f"{space}{ending}": Look(f"{LOOKS[space].label}{ending}", LOOKS[space].colour, line)
    for space in SPACES
    for ending, line in (("", "-"), (UNDAMPED, DOTTED))
}
COSTS = {
    "Iterations per decode (median, p99)": ("iterations_p50", "iterations_p99"),
    "Decode [ms] (median, p99; line: paper)": ("decode_p50_ms", "decode_p99_ms"),
}


def summary(report: Report) -> list[dict[str, Any]]:
    """Both modes and all sizes taken together: a record per ``around``, ``damped`` and ``space``.

    Keys: share of invalid actions (``share``) and its exact 95 % interval (``low``, ``high``), shares by cause
    (``causes.<cause>``), and the highest ``iterations_p99``, ``decode_p50_ms`` and ``decode_p99_ms``.
    """
    groups = _pooled(report).groupby(["around", "damped", "space"])
    counts = groups.sum(numeric_only=True).astype(int)
    rows = groups[["iterations_p99", "decode_p50_ms", "decode_p99_ms"]].max()
    rows = rows.join(counts.filter(like="causes.").div(counts["actions"], axis="index"))
    rows["share"] = counts["invalid"] / counts["actions"]
    rows[["low", "high"]] = [exact_interval(*each) for each in zip(counts["invalid"], counts["actions"], strict=True)]
    order = pd.MultiIndex.from_product((AROUND, SOLVERS, _spaces(report)), names=rows.index.names)  # pyrefly: ignore[bad-argument-type]
    return rows.reindex(order).reset_index().to_dict("records")  # pyrefly: ignore[bad-return]


def findings(report: Report) -> list[str]:
    """Sentences that say which space has most invalid actions, what damping changes, and what decoding costs."""
    return sentences("validity_findings.txt.j2", rows=summary(report), around=AROUND, paper=report["paper_ms"])


def validity_table(report: Report) -> str:
    """Share of invalid actions of each space by cause, and what decoding costs; then the findings."""
    listed = "\n".join(f"- {finding}" for finding in findings(report))
    return f"{markdown_table(table('validity', rows=summary(report), around=AROUND))}\n\n{listed}"


@styled
def validity_figure(report: Report) -> Figure:
    """Invalid actions over their size, their causes, iterations and decode times."""
    figure = Figure(figsize=(15.0, 7.0))
    axes = figure.subplots(2, 4)
    data = pd.DataFrame(report["cells"])
    data = data.assign(x=1e3 * data["size"], value=100 * data["invalid_rate"])
    data[["low", "high"]] = 100 * np.array(data["interval"].tolist())
    data.loc[~data["damped"], ["low", "high"]] = np.nan  # their intervals are alike, and would hide the others
    data["series"] = data["space"].where(data["damped"], data["space"] + UNDAMPED)
    curves = {name: look for name, look in CURVES.items() if name in set(data["series"])}
    for axis, (around, mode) in zip(axes[0], itertools.product(AROUND, ("delta", "absolute")), strict=True):
        curve_chart(axis, where(data, around=around, mode=mode), curves, log=True)
        percent_axis(axis)
        axis.set(xlabel="Action size [mm]", title=f"{mode.capitalize()} actions around {AROUND[around]}")
    pooled = _pooled(report)
    for axis, around in zip(axes[1], AROUND, strict=False):
        rows = where(pooled, around=around, damped=True)
        rows = rows.assign(group=rows["space"].map(label_of) + " " + rows["mode"])
        shares = [rows.assign(series=cause, value=100 * rows[f"causes.{cause}"] / rows["actions"]) for cause in CAUSES]
        bar_chart(axis, pd.concat(shares), CAUSES, stacked=True)
        percent_axis(axis)
        axis.set_title(f"Causes around {AROUND[around]}, all sizes")
        axis.tick_params("x", rotation=90)
    for axis, (title, (median, tail)) in zip(axes[1, 2:], COSTS.items(), strict=True):
        most = pooled.groupby(["space", "damped"], sort=False)[[median, tail]].max().reset_index()
        most = most.assign(group=most["space"].map(label_of), series=most["damped"], value=most[median])
        bar_chart(axis, most.assign(low=most[median], high=most[tail]), SOLVERS)
        axis.set_title(title)
    for x, space in enumerate(_spaces(report)):
        if space in report["paper_ms"]:
            axes[1, 3].plot([x - 0.45, x + 0.45], [report["paper_ms"][space]] * 2, color=INK, linewidth=1.2)
    axes[0, 0].set_ylabel("Invalid actions [%]")
    axes[1, 0].set_ylabel("Invalid actions by cause [%]")
    for axis in (axes[0, 0], axes[1, 0], axes[1, 2]):
        axis.legend(loc="upper left")
    return figure


def _spaces(report: Report) -> list[str]:
    """The spaces that were studied, in the order in which they are shown."""
    return sorted({row["space"] for row in report["pooled"]}, key=SPACES.index)


def _pooled(report: Report) -> pd.DataFrame:
    """A row per space, mode, ``around`` and ``damped``, with the counts of causes in columns ``causes.<cause>``."""
    pooled = pd.json_normalize(report["pooled"])
    return pooled.sort_values("space", key=lambda spaces: spaces.map(SPACES.index), kind="stable")
