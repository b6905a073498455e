"""The study of invalid actions: its figure, its table and its findings, rendered from its report alone."""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from er_il.evaluation.statistics import exact_interval
from er_il.report.charts import bar_chart, curve_chart, percent_axis, where
from er_il.report.style import BLUE, DOTTED, GREY, INK, LOOKS, RED, SKY, YELLOW, Look, new_figure, styled
from er_il.report.tables import markdown_table
from er_il.report.text import sentences

Report = Mapping[str, Any]

SPACES = ("task", "erj", "era")
AROUND = {"demos": "demonstrations", "random": "random states"}
CAUSES = {
    "unreachable": Look("unreachable", BLUE),
    "limit": Look("joint limit", SKY),
    "jump": Look("jump", RED),
    "not_converged": Look("not converged", YELLOW),
    "invalid": Look("other", GREY),
}
SOLVERS = {True: Look("damped", BLUE), False: Look("undamped", SKY)}


def summary(report: Report) -> pd.DataFrame:
    """Both modes and all sizes taken together: a row per ``around``, ``damped`` and ``space``.

    Columns: share of invalid actions (``share``) and its exact 95 % interval (``low``, ``high``), share by cause
    (``causes``), and the highest ``iterations_p99``, ``decode_p50_ms`` and ``decode_p99_ms``.
    """
    rows = []
    data = pd.DataFrame(report["pooled"])
    for around, damped, space in itertools.product(AROUND, SOLVERS, SPACES):
        part = where(data, around=around, damped=damped, space=space)
        actions, invalid = int(part["actions"].sum()), int(part["invalid"].sum())
        low, high = exact_interval(invalid, actions)
        rows.append(
            {"around": around, "damped": damped, "space": space, "share": invalid / actions, "low": low, "high": high}
            | {"causes": (pd.DataFrame(list(part["causes"])).sum() / actions).to_dict()}
            | part[["iterations_p99", "decode_p50_ms", "decode_p99_ms"]].max().to_dict()
        )
    return pd.DataFrame(rows)


def findings(report: Report) -> list[str]:
    """Sentences that say which space has most invalid actions, what damping changes, and what decoding costs."""
    rows = summary(report)
    damped, undamped = (where(rows, damped=each).reset_index() for each in (True, False))
    most = []
    for around in AROUND:
        part = where(damped, around=around)
        ranking = part.sort_values("share", ascending=False)
        most.append({"rows": part.to_dict("records"), "ranking": ranking.to_dict("records")})
    return sentences(
        "validity_findings.txt.j2",
        most=most,
        around=AROUND,
        change=(undamped["share"] - damped["share"]).abs().max(),
        iterations=[each["iterations_p99"].max() for each in (damped, undamped)],
        costs={
            space: where(damped, space=space)[["decode_p50_ms", "decode_p99_ms"]].max().to_dict() for space in SPACES
        },
        paper=report["paper_ms"],
    )


def validity_table(report: Report) -> str:
    """Share of invalid actions of each space by cause, and what decoding costs; then the findings."""

    def causes(row: Report) -> str:
        return ", ".join(
            f"{cause.replace('_', ' ')} {share:.0%}" for cause, share in row["causes"].items() if share >= 0.005
        )

    table = markdown_table(
        summary(report).to_dict("records"),
        {
            "Around": lambda row: AROUND[row["around"]],
            "Solver": lambda row: SOLVERS[row["damped"]].label,
            "Space": lambda row: row["space"],
            "Invalid actions": lambda row: f"**{row['share']:.0%}**",
            "95 % interval": lambda row: f"{row['low']:.0%} – {row['high']:.0%}",
            "Causes": causes,
            "Iterations p99": lambda row: f"{row['iterations_p99']:.0f}",
            "Decode time p50 / p99": lambda row: f"{row['decode_p50_ms']:.1f} / {row['decode_p99_ms']:.1f} ms",
        },
    )
    return f"{table}\n\n" + "\n".join(f"- {finding}" for finding in findings(report))


@styled
def validity_figure(report: Report) -> Figure:
    """Invalid actions over their size, their causes, iterations and decode times."""
    figure = new_figure(15.0, 7.0)
    axes = figure.subplots(2, 4)
    data = pd.DataFrame(report["cells"])
    bounds = 100 * np.array(data["interval"].tolist())
    data = data.assign(x=1e3 * data["size"], value=100 * data["invalid_rate"], low=bounds[:, 0], high=bounds[:, 1])
    data.loc[~data["damped"], ["low", "high"]] = np.nan  # their intervals are alike, and would hide the others
    data["series"] = data["space"].where(data["damped"], data["space"] + ", undamped")
    looks: dict[str, Look] = {}
    for space in SPACES:
        label, colour = LOOKS[space].label, LOOKS[space].colour
        looks |= {space: LOOKS[space], f"{space}, undamped": Look(f"{label}, undamped", colour, DOTTED)}
    for axis, (around, mode) in zip(axes[0], itertools.product(AROUND, ("delta", "absolute")), strict=True):
        curve_chart(axis, where(data, around=around, mode=mode), looks, log=True)
        percent_axis(axis)
        axis.set(xlabel="Action size [mm]", title=f"{mode.capitalize()} actions around {AROUND[around]}")
    pooled = pd.DataFrame(report["pooled"])
    for axis, around in zip(axes[1], AROUND, strict=False):
        bar_chart(axis, _causes(where(pooled, around=around, damped=True)), CAUSES, stacked=True)
        percent_axis(axis)
        axis.set_title(f"Causes around {AROUND[around]}, all sizes")
    costs = {
        "iterations": "Iterations per decode (median, p99)",
        "decode": "Decode [ms] (median, p99; line: paper)",
    }
    for axis, (cost, title) in zip(axes[1, 2:], costs.items(), strict=True):
        bar_chart(axis, _costs(pooled, cost), {look.label: look for look in SOLVERS.values()})
        axis.set_title(title)
    for x, space in enumerate(SPACES):
        axes[1, 3].plot([x - 0.45, x + 0.45], [report["paper_ms"][space]] * 2, color=INK, linewidth=1.2)
    axes[0, 0].set_ylabel("Invalid actions [%]")
    axes[1, 0].set_ylabel("Invalid actions by cause [%]")
    for axis in (axes[0, 0], axes[1, 0], axes[1, 2]):
        axis.legend(loc="upper left")
    return figure


def _causes(rows: pd.DataFrame) -> pd.DataFrame:
    """Shares in percent, a row per cause, space and mode."""
    return pd.DataFrame(
        [
            {"group": f"{LOOKS[row['space']].label}\n{row['mode']}", "series": cause}
            | {"value": 100 * row["causes"][cause] / row["actions"]}
            for space in SPACES
            for row in where(rows, space=space).to_dict("records")
            for cause in CAUSES
        ]
    )


def _costs(pooled: pd.DataFrame, cost: str) -> pd.DataFrame:
    """Medians with 99th percentiles, those of the most expensive kind of actions, a row per space and solver."""
    middle, tail = ("decode_p50_ms", "decode_p99_ms") if cost == "decode" else ("iterations_p50", "iterations_p99")
    most = pooled.groupby(["space", "damped"], sort=False)[[middle, tail]].max().reset_index()
    groups = [LOOKS[space].label for space in most["space"]]
    series = [SOLVERS[damped].label for damped in most["damped"]]
    return most.assign(group=groups, series=series, value=most[middle], low=most[middle], high=most[tail])
