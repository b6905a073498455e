"""Figures of experiments with agents: success over decisions, invalid actions, and aggregates over a suite."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from er_il.report.charts import Cells, percent_axis
from er_il.report.style import legend, looks_of, styled

COLUMNS = 3  # of panels
THOUSAND = 1000.0

Curves = Callable[[Mapping[str, Any]], NDArray[np.float64]]  # (seeds, evaluations) [%] of a cell's curve


@styled
def learning_figure(cells: Cells) -> Figure:
    """Success over the decisions learnt from: a panel a task, of each mode the mean and every seed."""
    figure = _curves_figure(cells, lambda curve: 100 * np.array(curve["successes"]) / curve["episodes"])
    for axis in figure.axes:
        percent_axis(axis)
    figure.supylabel("Success rate [%]", fontsize="medium")
    return figure


@styled
def invalid_figure(cells: Cells) -> Figure:
    """Share of invalid actions while learning: a panel a task, of each mode the mean and every seed."""
    figure = _curves_figure(cells, lambda curve: 100 * np.array(curve["invalid_rates"]))
    for axis in figure.axes:
        axis.set_ylim(bottom=0)
    figure.supylabel("Invalid actions while learning [%]", fontsize="medium")
    return figure


@styled
def suite_figure(suite: Sequence[Mapping[str, Any]]) -> Figure:
    """Interquartile mean of each mode over all tasks, with its interval."""
    figure = Figure(figsize=(6.0, 0.9 + 0.32 * len(suite)))
    axis = figure.subplots()
    looks = looks_of(each["decoder"] for each in suite)
    for row, each in enumerate(reversed(suite)):
        look, value = looks[each["decoder"]], 100 * each["iqm"]
        low, high = (100 * bound for bound in each["interval"])
        axis.barh(row, high - low, left=low, height=0.6, color=look.colour, alpha=0.45)
        axis.plot([value, value], [row - 0.3, row + 0.3], color=look.colour, linewidth=3)
    axis.set_yticks(range(len(suite)), [looks[each["decoder"]].label for each in reversed(suite)])
    axis.set(xlim=(-1, 101), xlabel="Interquartile mean of the success rate [%]")
    return figure


def _curves_figure(cells: Cells, values: Curves) -> Figure:
    tasks = list(dict.fromkeys(cell["task"] for cell in cells))
    looks = looks_of(dict.fromkeys(cell["decoder"] for cell in cells))
    columns = min(COLUMNS, len(tasks))
    rows = -(-len(tasks) // columns)
    figure = Figure(figsize=(max(5.0, 0.6 + 3.4 * columns), 0.9 + 2.5 * rows))
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    for axis in axes[len(tasks) :]:
        axis.remove()
    for task, axis in zip(tasks, axes, strict=False):
        for cell in (cell for cell in cells if cell["task"] == task):
            _draw(axis, np.array(cell["curve"]["steps"]) / THOUSAND, values(cell["curve"]), looks[cell["decoder"]])
        axis.set_title(task.replace("_", " "))
    figure.supxlabel("Decisions learnt from, in thousands", fontsize="medium")
    legend(figure)
    return figure


def _draw(axis: Axes, steps: NDArray[np.float64], of_seeds: NDArray[np.float64], look: Any) -> None:
    for values in of_seeds:
        axis.plot(steps, values, color=look.colour, linestyle=look.line, linewidth=0.7, alpha=0.35)
    axis.plot(steps, of_seeds.mean(axis=0), color=look.colour, linestyle=look.line, linewidth=1.8, label=look.label)
