"""The picture of a study of joints, drawn from its report alone."""

import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

Report = Mapping[str, Any]

TWIST, BEND, MIXED = "#0072B2", "#E69F00", "#999999"  # Okabe and Ito's palette: told apart by every eye
DARK, LIGHT = 1.0, 0.25  # from the first to the last set
PANEL, HEIGHT = 4.6, 3.0  # [inch]


def plot(report: Report, path: Path) -> None:
    """Draw what commanding each choice of joints does: structure, singularities, playback and, if there, training."""
    sets = {"workspace": report["workspace"], **report["demos"]}
    panels = [_self_motion, _singular_values, _risk, _round_trips]
    panels += [_playback] * bool(report["demos"]) + [_training] * bool(report.get("training"))
    columns = -(-len(panels) // 2)
    figure = Figure(figsize=(PANEL * columns, 2 * HEIGHT), dpi=110, layout="constrained")
    axes = figure.subplots(2, columns).ravel()
    for empty in axes[len(panels) :]:
        empty.set_axis_off()
    for panel, axis in zip(panels, axes, strict=False):
        panel(axis, report, sets)
        names = [_short(each["joints"], report["joints"]) for each in report["workspace"]]
        crowded = len(names) > 10
        axis.set_xticks(range(len(names)), names, rotation=90 if crowded else 0, fontsize=6 if crowded else 9)
        axis.set_xlabel("commanded joint")
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(axis="y", color="#e5e5e5", zorder=0)
    kinds = [Patch(color=colour, label=label) for colour, label in ((TWIST, "twisting joint"), (BEND, "bending joint"))]
    shades = [Patch(color=MIXED, alpha=a, linewidth=0, label=name) for a, name in zip(_shades(sets), sets, strict=True)]
    figure.legend(handles=[*kinds, *shades], loc="outside lower center", ncols=8, fontsize=8, frameon=False)
    best = " + ".join(report["recommended"])
    figure.suptitle(
        f"{report['arm']}: which joint should ERJ command?   Advice: {best}", x=0.01, ha="left", fontsize=11
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def _self_motion(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    _bars(axis, report, {name: [each["self_motion"] for each in of_set] for name, of_set in sets.items()})
    axis.set_title("Self-motion turns it at (share of its speed)", loc="left", fontsize=9)


def _singular_values(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    shifts = np.linspace(-0.3, 0.3, len(sets)) if len(sets) > 1 else [0.0]
    for shift, shade, of_set in zip(shifts, _shades(sets), sets.values(), strict=True):
        for x, (each, colour) in enumerate(zip(of_set, _colours(report), strict=True)):
            low, middle = max(each["smallest_p05"], 1e-4), max(each["smallest_p50"], 1e-4)
            axis.plot([x + shift] * 2, [low, middle], color=colour, alpha=shade, linewidth=2.5, zorder=2)
            axis.plot(x + shift, middle, "o", color=colour, alpha=shade, markersize=5, zorder=3)
    axis.axhline(report["settings"]["singular"], color="#555555", linestyle="--", linewidth=0.9)
    axis.set_yscale("log")
    axis.set_title("Smallest singular value (5th percentile to median)", loc="left", fontsize=9)


def _risk(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    _bars(axis, report, {name: [100 * each["risk"] for each in of_set] for name, of_set in sets.items()})
    axis.set_ylim(0, 100)
    axis.set_title("Near a singularity, or joints lost [%]", loc="left", fontsize=9)


def _round_trips(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    _bars(axis, report, {name: [100 * each["missed"] for each in of_set] for name, of_set in sets.items()})
    seed = report["settings"]["seed_error_rad"]
    axis.set_title(f"Round trips that miss the joints [%], seeds {seed} rad off", loc="left", fontsize=9)


def _playback(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    _bars(axis, report, {name: [each["flips"] for each in of_set] for name, of_set in report["demos"].items()}, sets)
    error = report["settings"]["playback_error_m"]
    axis.set_title(f"Branch flips a demo, actions {1e3 * error:.0f} mm off", loc="left", fontsize=9)


def _training(axis: Axes, report: Report, sets: Mapping[str, Any]) -> None:
    names = [" + ".join(each["joints"]) for each in report["workspace"]]
    values, spreads = {}, {}
    for prediction in report["training"]:
        rows = {row["joints"]: row for row in prediction["choices"]}
        values[prediction["task"]] = [100 * rows[name]["success"] if name in rows else np.nan for name in names]
        spreads[prediction["task"]] = [rows[name]["interval"] if name in rows else (np.nan, np.nan) for name in names]
    _bars(axis, report, values, sets, spreads)
    axis.set_ylim(0, 100)
    axis.set_title("ACT policies trained with it: success [%]", loc="left", fontsize=9)


def _bars(
    axis: Axes,
    report: Report,
    values: Mapping[str, Sequence[float]],
    sets: Mapping[str, Any] | None = None,
    spreads: Mapping[str, Sequence[Sequence[float]]] | None = None,
) -> None:
    """A group of bars a choice, a bar a set, each set in its shade wherever it is drawn."""
    width = 0.8 / len(values)
    shades = dict(zip(sets or values, _shades(sets or values), strict=True))
    for number, (name, of_set) in enumerate(values.items()):
        x = np.arange(len(of_set)) - 0.4 + (number + 0.5) * width
        for at, value, colour in zip(x, of_set, _colours(report), strict=True):
            axis.bar(at, value, width, color=colour, alpha=shades.get(name, 1.0), zorder=2)
        if spreads:
            bounds = 100 * np.array(spreads[name]).T
            errors = np.abs(bounds - np.array(of_set))
            axis.errorbar(x, of_set, yerr=errors, fmt="none", color="#222222", capsize=2, linewidth=0.9, zorder=3)


def _shades(sets: Mapping[str, Any]) -> list[float]:
    return np.linspace(DARK, LIGHT, len(sets)).tolist()


def _colours(report: Report) -> list[str]:
    kinds = [{joint in report["twisting"] for joint in each["joints"]} for each in report["workspace"]]
    return [MIXED if len(kind) == 2 else TWIST if True in kind else BEND for kind in kinds]


def _short(choice: Sequence[str], joints: Sequence[str]) -> str:
    """Names without what all of the arm's joints begin with."""
    alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*joints, strict=False))
    shared = len(list(alike))
    return "+".join(joint[shared:] or joint for joint in choice)
