"""The picture of a study of invalid actions, drawn from its report alone."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from er_il.report.success import COLOURS

Report = Mapping[str, Any]

SPACE_COLOURS = {"task": COLOURS["task-nearest"], "erj": COLOURS["erj"], "era": COLOURS["era"]}
CAUSE_COLOURS = {
    "unreachable": "#0072B2",
    "limit": "#56B4E9",
    "jump": "#D55E00",
    "not_converged": "#F0E442",
    "invalid": "#999999",
}
AROUND = {"demos": "around demonstrations", "random": "around random states"}


def plot(report: Report, path: Path) -> None:
    """Draw invalid shares by size, their causes, iterations and latency."""
    figure = Figure(figsize=(15.0, 6.6), dpi=110, layout="constrained")
    axes = figure.subplots(2, 4)
    for axis, (around, mode) in zip(axes[0], itertools.product(AROUND, ("delta", "absolute")), strict=True):
        _shares(axis, report, around, mode)
    axes[0][0].legend(fontsize=7, frameon=False)
    axes[0][0].set_ylabel("Invalid actions [%]")
    for axis, around in zip(axes[1], AROUND, strict=False):
        _causes(axis, report, around)
    axes[1][0].legend(fontsize=7, frameon=False)
    axes[1][0].set_ylabel("Invalid actions by cause [%]")
    _costs(axes[1][2], report, "iterations")
    axes[1][2].set_title("Iterations of a decode (median to p99)", loc="left", fontsize=9)
    _costs(axes[1][3], report, "decode")
    for x, ms in enumerate(report["paper_ms"][space] for space in SPACE_COLOURS):
        axes[1][3].plot([x - 0.4, x + 0.4], [ms, ms], color="#222222", linewidth=1.2)
    axes[1][3].set_title("Decode [ms] (median to p99); line: the paper", loc="left", fontsize=9)
    for axis in axes.flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(axis="y", color="#e5e5e5", zorder=0)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _shares(axis: Axes, report: Report, around: str, mode: str) -> None:
    for (space, colour), damped in itertools.product(SPACE_COLOURS.items(), (True, False)):
        cells = [
            cell
            for cell in report["cells"]
            if (cell["space"], cell["around"], cell["mode"], cell["damped"]) == (space, around, mode, damped)
        ]
        sizes, shares = [1e3 * cell["size"] for cell in cells], [100 * cell["invalid_rate"] for cell in cells]
        label = space.upper() if damped else f"{space.upper()}, undamped"
        axis.plot(sizes, shares, color=colour, linestyle="-" if damped else ":", marker="o", markersize=3, label=label)
        if damped:
            low, high = 100 * np.array([cell["interval"] for cell in cells]).T
            axis.fill_between(sizes, low, high, color=colour, alpha=0.12, linewidth=0)
    axis.set(xscale="log", ylim=(0, 100), xlabel="size of the action [mm]")
    ticks = [1e3 * size for size in report["sizes_m"]]
    axis.set_xticks(ticks, [f"{size:g}" for size in ticks])
    axis.minorticks_off()
    axis.set_title(f"{mode.capitalize()} actions {AROUND[around]}", loc="left", fontsize=9)


def _causes(axis: Axes, report: Report, around: str) -> None:
    """Bars of delta and absolute actions side by side, all sizes together, damped."""
    rows = [row for row in report["pooled"] if row["around"] == around and row["damped"]]
    ticks = []
    for row in rows:
        x = list(SPACE_COLOURS).index(row["space"]) + (-0.2 if row["mode"] == "delta" else 0.2)
        ticks.append((x, f"{row['space'].upper()}\n{row['mode']}"))
        bottom = 0.0
        for cause, colour in CAUSE_COLOURS.items():
            share = 100 * row["causes"][cause] / row["actions"]
            axis.bar(x, share, 0.36, bottom=bottom, color=colour, zorder=2, label=cause if row is rows[0] else None)
            bottom += share
    axis.set_xticks([x for x, _ in ticks], [label for _, label in ticks], fontsize=7)
    axis.set_ylim(0, 100)
    axis.set_title(f"Why, {AROUND[around]}, all sizes", loc="left", fontsize=9)


def _costs(axis: Axes, report: Report, what: str) -> None:
    """From the median to the 99th percentile, damped and undamped, the slower way of drawing actions."""
    middle, tail = ("decode_p50_ms", "decode_p99_ms") if what == "decode" else ("iterations_p50", "iterations_p99")
    for (x, (space, colour)), damped in itertools.product(enumerate(SPACE_COLOURS.items()), (True, False)):
        rows = [row for row in report["pooled"] if row["space"] == space and row["damped"] is damped]
        low, high = (max(row[key] for row in rows) for key in (middle, tail))
        at = x + (-0.15 if damped else 0.15)
        axis.plot(
            [at, at], [low, high], color=colour, linewidth=3, linestyle="-" if damped else (0, (1, 0.6)), zorder=2
        )
        axis.plot(at, low, "o", color=colour, markersize=5, zorder=3)
    axis.set_xticks(range(len(SPACE_COLOURS)), [space.upper() for space in SPACE_COLOURS])
    axis.set_ylim(bottom=0)
