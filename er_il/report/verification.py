"""The report of a dataset's verification: round-trip errors and distance from singularities, frame by frame."""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from er_il.datasets.verification import Verification
from er_il.report.style import BLUE, GREEN, GREY, GRID, ORANGE, new_figure, styled
from er_il.report.tables import Columns
from er_il.report.text import sentences
from er_il.spaces.round_trip import EXACT, SINGULAR

FLOOR = 1e-9  # [rad] errors below are drawn here: a logarithmic axis needs one
WIDTH, HEIGHT = 10.0, 3.0  # [in] of a row
SEPARATED = 60  # episodes at most between which lines are drawn
SHOWN = 5  # entries of a list that are named; the JSON has all

# Key of an arm's report to its heading.
ROWS = {
    "flagged": "frames flagged",
    "joint_error": "joint error [rad] p50, p95, p99, max",
    "joint_error_unflagged": "joint error [rad] max, not flagged",
    "position_error": "position error [m] p50, p95, p99, max",
    "rotation_error": "rotation error [rad] p50, p95, p99, max",
}


def verification_columns(report: Mapping[str, Any]) -> Columns:
    """Columns of the summary, a row per key of :data:`ROWS`: its heading, and the value of each arm."""

    def of_arm(values: Mapping[str, Any], key: str) -> str:
        found = values[key]
        if found is None:
            return "joints not kept"
        if key == "joint_error_unflagged":
            found = {name: value for name, value in found.items() if name == "p100"}
        return str(found) if key == "flagged" else "  ".join(f"{value:.0e}" for value in found.values()) or "none"

    columns: dict[str, Any] = {" ": lambda key: ROWS[key]}
    return columns | {arm: lambda key, values=values: of_arm(values, key) for arm, values in report["arms"].items()}


def verification_notes(report: Mapping[str, Any]) -> list[str]:
    """Sentences on invalid frames, singularities and quaternion signs."""
    return sentences("verification.txt.j2", report=report, shown=SHOWN)


@styled
def verification_figure(verification: Verification, title: str) -> Figure:
    """A row per arm: joint errors (flagged frames apart) and the smallest singular value."""
    figure = new_figure(WIDTH, HEIGHT * len(verification.arms))
    axes = figure.subplots(len(verification.arms), 2, squeeze=False)
    starts = np.cumsum([0, *(len(each.status) for each in verification.episodes)])
    for arm, (label, (left, right)) in enumerate(zip(verification.arms, axes, strict=True)):
        _errors(left, verification, arm)
        left.set_title(f"{label}: round trip")
        _conditioning(right, verification, arm, starts.tolist())
        right.set_title(f"{label}: smallest singular value")
        for axis in (left, right):
            axis.set(xlabel="Frame", xlim=(0, starts[-1]))
            for start in starts[1:-1] if len(starts) <= SEPARATED else ():
                axis.axvline(start, color=GRID, linewidth=0.6, zorder=0)
    figure.suptitle(title)
    return figure


def _errors(axis: Axes, verification: Verification, arm: int) -> None:
    flagged = verification.gathered("flagged")[arm].astype(bool)
    errors = verification.gathered("error" if verification.compared else "position_error")[arm]
    for chosen, colour, label in ((~flagged, BLUE, "not flagged"), (flagged, ORANGE, "flagged")):
        if chosen.any():
            shown = np.maximum(errors[chosen], FLOOR)
            axis.plot(np.flatnonzero(chosen), shown, ".", markersize=2, color=colour, label=label, rasterized=True)
    axis.axhline(EXACT, color=GREY, linewidth=0.8, linestyle="--")
    axis.set(yscale="log", ylabel="Joint error [rad]" if verification.compared else "Position error [m]")
    axis.legend(loc="upper right", markerscale=4)


def _conditioning(axis: Axes, verification: Verification, arm: int, starts: list[int]) -> None:
    sigma = verification.gathered("conditioning")[arm]
    axis.set_ylabel("Metres and radians mixed")
    if not np.all(np.isfinite(sigma)):
        axis.text(0.5, 0.5, "joint space: none", transform=axis.transAxes, ha="center")
        return
    for first, stop in itertools.pairwise(starts):
        axis.plot(range(first, stop), sigma[first:stop], linewidth=0.6, color=GREEN, rasterized=True)
    axis.axhline(SINGULAR, color=GREY, linewidth=0.8, linestyle="--")
    axis.set_ylim(bottom=0)
