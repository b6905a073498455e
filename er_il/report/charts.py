"""The two charts of all reports: bars, and values over a number, both with intervals.

Their data have a row per bar or point: its ``group``, or its number ``x``; its ``series``, whose looks are given in
drawing order; its ``value`` and, for an error bar, the bounds ``low`` and ``high``.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from er_il.report import paper
from er_il.report.style import INK, Look, legend, looks_of, styled
from er_il.report.text import Report

Cells = Sequence[Report]
Looks = Mapping[Any, Look]  # of the series, in drawing order

GROUP_WIDTH = 0.8  # of the bars of a group, whose centres are 1 apart
DODGE = 0.06  # shift between series that would hide each other: of the x axis, or octaves of a logarithmic one
COUNTED = 12  # bars at most whose counts are written above them
NARROWEST = 5.0  # [in] of a figure of bars: its legend needs room


def where(data: pd.DataFrame, **values: object) -> pd.DataFrame:
    """The rows whose columns have these values."""
    for column, value in values.items():
        data = data.loc[data[column].to_numpy() == value]
    return data


def bar_chart(axis: Axes, data: pd.DataFrame, looks: Looks, *, stacked: bool = False) -> pd.DataFrame:
    """Draw groups of bars, side by side or stacked with the first row's lowest; return the data with the bars' x."""
    at, groups = pd.factorize(data["group"])
    width = GROUP_WIDTH / (1 if stacked else len(looks))
    shift = 0 if stacked else (data["series"].map(list(looks).index) - (len(looks) - 1) / 2) * width
    data = data.assign(x=at + shift, bottom=data.groupby("group")["value"].cumsum() - data["value"] if stacked else 0)
    for series, look in looks.items():
        rows = where(data, series=series)
        style = {"color": look.colour, "label": look.label, "zorder": 2}
        axis.bar(rows["x"], rows["value"], 0.88 * width, rows["bottom"], **style)
        axis.errorbar(rows["x"], rows["value"], _spread(rows), fmt="none", ecolor=INK, elinewidth=1, capsize=2)
    axis.set_xticks(range(len(groups)), groups)
    axis.set_xlim(-0.5, len(groups) - 0.5)  # as wide for a group with a bar or more missing
    return data


def curve_chart(axis: Axes, data: pd.DataFrame, looks: Looks, *, log: bool = False) -> None:
    """Draw a line per series over a number, which may be on a logarithmic axis."""
    ticks = sorted(set(data["x"]))
    if log:
        axis.set_xscale("log", base=2)
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.minorticks_off()
    for number, (series, look) in enumerate(looks.items()):
        rows = where(data, series=series).sort_values("x")
        dodge = DODGE * (number - (len(looks) - 1) / 2)
        x = rows["x"] * 2**dodge if log else rows["x"] + dodge
        style: Mapping[str, Any] = {"color": look.colour, "linestyle": look.line, "label": look.label}
        axis.errorbar(x, rows["value"], _spread(rows), marker="o", capsize=2, elinewidth=1, **style)


def percent_axis(axis: Axes) -> None:
    """Let the y axis go from 0 to 100 %."""
    axis.set(ylim=(-3, 104), yticks=range(0, 101, 25))


def success_data(cells: Cells) -> pd.DataFrame:
    """Cells as data of the charts: success in percent, tasks as groups and decoders as series."""
    data = pd.DataFrame(cells).rename(columns={"decoder": "series", "demonstrations": "x"})
    low, high = 100 * np.array(data["interval"].tolist()).T
    value = 100 * data["successes"] / data["episodes"]
    return data.assign(group=data["task"].str.replace("_", " "), value=value, low=low, high=high)


@styled
def success_figure(cells: Cells, *, compared: bool = False) -> Figure:
    """Success of each decoder on each task, with exact 95 % intervals and, if ``compared``, the paper's rates."""
    data = success_data(cells)
    looks, counted = looks_of(data["series"].unique()), len(data) <= COUNTED
    width = 1 + data["task"].nunique() * (0.4 + (0.55 if counted else 0.18) * len(looks))
    figure = Figure(figsize=(max(NARROWEST, width), 3.8))
    axis = figure.subplots()
    bars = bar_chart(axis, data, looks).to_dict("records")
    percent_axis(axis)
    axis.set_ylabel("Success rate [%]")
    if counted:
        axis.set_ylim(top=114)
        for bar in bars:
            axis.annotate(f"{bar['successes']}/{bar['episodes']}", (bar["x"], 105), ha="center", fontsize=8)
    published = [(bar["x"], paper.share(bar["task"], bar["series"])) for bar in bars if compared]
    if marks := [(x, 100 * share) for x, share in published if share is not None]:
        label = f"Paper, {paper.ROLLOUTS} rollouts on a real arm"
        axis.plot(*zip(*marks, strict=True), "D", color="white", markeredgecolor=INK, label=label, zorder=4)
    legend(figure)
    return figure


@styled
def demonstrations_figure(cells: Cells) -> Figure:
    """Success over the number of demonstrations, a panel per task and a line per decoder."""
    return _curves(success_data(cells), "Training demonstrations", log=True)


@styled
def widths_figure(cells: Cells) -> Figure:
    """Success over the width of the square in which the cup starts, a panel per task and a line per decoder."""
    data = success_data(cells)
    return _curves(data.assign(x=100 * data["within"]), "Cup placed within a square of [cm]")


def _curves(data: pd.DataFrame, over: str, *, log: bool = False) -> Figure:
    looks, tasks = looks_of(data["series"].unique()), data["group"].unique()
    figure = Figure(figsize=(1 + 3.4 * len(tasks), 3.8))
    axes = figure.subplots(1, len(tasks), squeeze=False, sharey=True)[0]
    for task, axis in zip(tasks, axes, strict=True):
        curve_chart(axis, where(data, group=task), looks, log=log)
        percent_axis(axis)
        axis.set(xlabel=over, title=task)
    axes[0].set_ylabel("Success rate [%]")
    legend(figure)
    return figure


def _spread(rows: pd.DataFrame) -> NDArray[np.float64] | None:
    """Lengths (2, N) of the error bars below and above the values, if they have bounds."""
    return rows[["low", "high"]].sub(rows["value"], axis="index").abs().to_numpy(float).T if "low" in rows else None
