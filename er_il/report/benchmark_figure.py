"""A benchmark's figures, drawn from its report alone."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from er_il.report import paper
from er_il.report.pictures import INK
from er_il.report.success import COLOURS, label_of

Cell = Mapping[str, Any]

# Of decoders without a colour of their own: Paul Tol's muted palette.
OTHER_COLOURS = (
    "#332288",
    "#88CCEE",
    "#44AA99",
    "#117733",
    "#999933",
    "#DDCC77",
    "#CC6677",
    "#882255",
    "#AA4499",
)
LEGEND_WIDTH = 2.1  # [in] of a column


def write_bars(cells: Sequence[Cell], path: Path, *, compared: bool = True) -> None:
    """Draw the success of each decoder on each task, with exact 95 % intervals.

    Args:
        cells: What was counted.
        path: Picture to write.
        compared: Whether to mark the paper's figures beside.
    """
    tasks, decoders = _named(cells, "task"), _named(cells, "decoder")
    width = 1 + len(tasks) * (0.4 + 0.18 * len(decoders))
    figure = Figure(figsize=(width, 4), dpi=140, layout="constrained")
    axis = figure.subplots()
    colours, bar = _colours(decoders), 0.8 / len(decoders)
    marked = False
    for cell in cells:
        index = decoders.index(cell["decoder"])
        x = tasks.index(cell["task"]) + (index - (len(decoders) - 1) / 2) * bar
        share, (low, high) = cell["successes"] / cell["episodes"], cell["interval"]
        label = label_of(cell["decoder"]) if cell["task"] == tasks[0] else None
        axis.bar(x, 100 * share, width=0.86 * bar, color=colours[cell["decoder"]], label=label, zorder=2)
        axis.errorbar(x, 100 * share, yerr=_spread(share, low, high), color=INK, capsize=2, linewidth=1, zorder=3)
        published = paper.share(cell["task"], cell["decoder"]) if compared else None
        if published is not None:
            label = f"the paper's, of {paper.ROLLOUTS} on a real arm" if not marked else None
            axis.plot(x, 100 * published, "D", color="white", markeredgecolor=INK, markersize=5, label=label, zorder=4)
            marked = True
    axis.set_xticks(range(len(tasks)), [task.replace("_", " ") for task in tasks])
    axis.margins(x=0.01)
    _finish(axis)
    handles, labels = axis.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: isinstance(handles[i], Line2D))  # the marks last
    names = [labels[i] for i in order]
    columns = max(1, min(4, int(width / LEGEND_WIDTH)))
    entries = [handles[i] for i in order]
    figure.legend(entries, names, loc="outside upper left", ncols=columns, fontsize=8, frameon=False)
    figure.savefig(path)


def write_curves(cells: Sequence[Cell], path: Path) -> None:
    """Draw success by the number of demonstrations, a panel a task and a line a decoder."""
    tasks, decoders = _named(cells, "task"), _named(cells, "decoder")
    figure = Figure(figsize=(1 + 3.4 * len(tasks), 3.8), dpi=140, layout="constrained")
    colours = _colours(decoders)
    for task, axis in zip(tasks, figure.subplots(1, len(tasks), squeeze=False, sharey=True)[0], strict=True):
        for place, decoder in enumerate(decoders):
            line = sorted(
                (cell for cell in cells if (cell["task"], cell["decoder"]) == (task, decoder)),
                key=lambda cell: cell["demonstrations"],
            )
            beside = 2 ** (0.06 * (place - (len(decoders) - 1) / 2))  # equal successes would hide one another
            counts = [beside * cell["demonstrations"] for cell in line]
            shares = [cell["successes"] / cell["episodes"] for cell in line]
            spreads = np.hstack([_spread(share, *cell["interval"]) for share, cell in zip(shares, line, strict=True)])
            axis.errorbar(
                counts,
                [100 * share for share in shares],
                yerr=spreads,
                fmt="o-",
                color=colours[decoder],
                label=label_of(decoder) if task == tasks[0] else None,
                markersize=4,
                capsize=3,
            )
        every = sorted({cell["demonstrations"] for cell in cells})
        axis.set_xscale("log", base=2)
        axis.set_xticks(every, [str(count) for count in every])
        axis.set_xlabel("Demonstrations to train on")
        axis.set_title(task.replace("_", " "), fontsize=10, loc="left")
        _finish(axis)
    figure.legend(loc="outside upper left", ncols=len(decoders), fontsize=8, frameon=False)
    figure.savefig(path)


def _finish(axis: Axes) -> None:
    axis.set_ylim(-3, 104)
    axis.set_yticks(range(0, 101, 25))
    axis.set_ylabel("Successful rollouts [%]")
    axis.grid(axis="y", color="#dddddd", zorder=0)
    axis.spines[["top", "right"]].set_visible(False)


def _spread(share: float, low: float, high: float) -> list[list[float]]:
    return [[100 * (share - low)], [100 * (high - share)]]


def _named(cells: Sequence[Cell], key: str) -> list[str]:
    return list(dict.fromkeys(cell[key] for cell in cells))


def _colours(decoders: Sequence[str]) -> dict[str, str]:
    others = iter(OTHER_COLOURS * len(decoders))
    return {name: COLOURS.get(name) or next(others) for name in decoders}
