"""The two charts of all reports: bars, and values over a number, both with intervals."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from er_il.report import paper
from er_il.report.style import INK, Look, legend, looks_of, new_figure, styled

Cells = Sequence[Mapping[str, Any]]

GROUP_WIDTH = 0.8  # of the bars of a group, whose centres are 1 apart
DODGE = 0.06  # shift between series that would hide each other: of the x axis, or octaves of a logarithmic one
COUNTED = 12  # bars at most whose counts are written above them
NARROWEST = 5.0  # [in] of a figure of bars: its legend needs room


def where(data: pd.DataFrame, **values: object) -> pd.DataFrame:
    """The rows whose columns have these values."""
    for column, value in values.items():
        data = data.loc[data[column].to_numpy() == value]
    return data


def bar_chart(
    axis: Axes, data: pd.DataFrame, looks: Mapping[str, Look], *, stacked: bool = False
) -> dict[tuple[str, str], float]:
    """Draw groups of bars.

    Args:
        axis: Where to draw.
        data: A row per bar: ``group``, ``series``, ``value`` and, for an error bar, the bounds ``low`` and ``high``.
        looks: The series in drawing order.
        stacked: Whether the bars of a group stand upon each other instead of side by side.

    Returns:
        The x coordinate of each bar by group and series.
    """
    groups = list(dict.fromkeys(data["group"]))
    width = GROUP_WIDTH / (1 if stacked else len(looks))
    top, positions = np.zeros(len(groups)), {}
    for number, (series, look) in enumerate(looks.items()):
        rows = where(data, series=series)
        at = np.array([groups.index(group) for group in rows["group"]], dtype=int)
        x = at + (0.0 if stacked else (number - (len(looks) - 1) / 2) * width)
        bottom = top[at] if stacked else 0.0
        axis.bar(x, rows["value"], 0.88 * width, bottom=bottom, color=look.colour, label=look.label, zorder=2)
        top[at] += rows["value"]
        if "low" in rows:
            axis.errorbar(
                x, rows["value"], yerr=_spread(rows), fmt="none", ecolor=INK, elinewidth=1, capsize=2, zorder=3
            )
        positions |= {(group, series): float(each) for group, each in zip(rows["group"], x, strict=True)}
    axis.set_xticks(range(len(groups)), groups)
    axis.margins(x=0.02)
    return positions


def curve_chart(axis: Axes, data: pd.DataFrame, looks: Mapping[str, Look], *, log: bool = False) -> None:
    """Draw a line per series over a number.

    Args:
        axis: Where to draw.
        data: A row per point: ``x``, ``series``, ``value`` and, for an error bar, the bounds ``low`` and ``high``.
        looks: The series in drawing order.
        log: Whether the number is on a logarithmic axis.
    """
    ticks = sorted(set(data["x"]))
    if log:
        axis.set_xscale("log", base=2)
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.minorticks_off()
    for number, (series, look) in enumerate(looks.items()):
        rows = where(data, series=series).sort_values("x")
        dodge = DODGE * (number - (len(looks) - 1) / 2)
        x = rows["x"] * 2**dodge if log else rows["x"] + dodge
        spread = _spread(rows) if "low" in rows else None
        options: Mapping[str, Any] = {"color": look.colour, "linestyle": look.line, "label": look.label}
        axis.errorbar(x, rows["value"], yerr=spread, marker="o", capsize=2, elinewidth=1, **options)


def percent_axis(axis: Axes, label: str = "") -> None:
    """Let the y axis go from 0 to 100 %."""
    axis.set_ylim(-3, 104)
    axis.set_yticks(range(0, 101, 25))
    axis.set_ylabel(label)


def success_data(cells: Cells) -> pd.DataFrame:
    """Cells as data of the charts: success in percent, tasks as groups and decoders as series."""
    bounds = 100 * np.array([cell["interval"] for cell in cells])
    data = pd.DataFrame([{key: cell.get(key) for key in ("task", "decoder", "demonstrations")} for cell in cells])
    data = data.rename(columns={"decoder": "series", "demonstrations": "x"})
    data["group"] = data["task"].map(_label)
    data["value"] = [100 * cell["successes"] / cell["episodes"] for cell in cells]
    return data.assign(low=bounds[:, 0], high=bounds[:, 1])


@styled
def success_figure(cells: Cells, *, compared: bool = False) -> Figure:
    """Success of each decoder on each task, with exact 95 % intervals.

    Args:
        cells: Reported cells.
        compared: Whether to mark the paper's success rates.
    """
    data = success_data(cells)
    looks = looks_of(dict.fromkeys(data["series"]))
    counted = len(cells) <= COUNTED
    width = 1 + data["task"].nunique() * (0.4 + (0.55 if counted else 0.18) * len(looks))
    figure = new_figure(max(NARROWEST, width), 3.8)
    axis = figure.subplots()
    positions = bar_chart(axis, data, looks)
    percent_axis(axis, "Success rate [%]")
    if counted:
        axis.set_ylim(top=114)
        for cell in cells:
            place = positions[_label(cell["task"]), cell["decoder"]], 105
            axis.annotate(f"{cell['successes']}/{cell['episodes']}", place, ha="center", fontsize=8)
    marks = [
        (positions[_label(cell["task"]), cell["decoder"]], 100 * published)
        for cell in cells
        if compared and (published := paper.share(cell["task"], cell["decoder"])) is not None
    ]
    if marks:
        label = f"Paper, {paper.ROLLOUTS} rollouts on a real arm"
        axis.plot(*zip(*marks, strict=True), "D", color="white", markeredgecolor=INK, label=label, zorder=4)
    legend(figure, axis)
    return figure


@styled
def demonstrations_figure(cells: Cells) -> Figure:
    """Success over the number of demonstrations, a panel per task and a line per decoder."""
    data = success_data(cells)
    looks, tasks = looks_of(dict.fromkeys(data["series"])), list(dict.fromkeys(data["group"]))
    figure = new_figure(1 + 3.4 * len(tasks), 3.8)
    axes = figure.subplots(1, len(tasks), squeeze=False, sharey=True)[0]
    for task, axis in zip(tasks, axes, strict=True):
        curve_chart(axis, where(data, group=task), looks, log=True)
        percent_axis(axis, "Success rate [%]" if task == tasks[0] else "")
        axis.set(xlabel="Training demonstrations", title=task)
    legend(figure, axes[0])
    return figure


def _label(task: str) -> str:
    return task.replace("_", " ")


def _spread(rows: pd.DataFrame) -> NDArray[np.float64]:
    """Lengths (2, N) of the error bars below and above the values."""
    return np.abs(np.array([rows["value"] - rows["low"], rows["high"] - rows["value"]], dtype=float))
