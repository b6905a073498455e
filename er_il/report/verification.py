"""The report of a dataset's verification: round-trip errors and distance from singularities, frame by frame."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from er_il.datasets.verification import Array, Flags, Verification
from er_il.report.style import BLUE, GREEN, GREY, GRID, ORANGE, styled
from er_il.spaces.round_trip import EXACT, SINGULAR

FLOOR = 1e-9  # [rad] errors below are drawn here: a logarithmic axis needs one
SEPARATED = 60  # episodes at most between which lines are drawn


@styled
def verification_figure(verification: Verification, title: str) -> Figure:
    """A row per arm: joint errors (flagged frames apart) and the smallest singular value."""
    name, label = ("error", "Joint error [rad]") if verification.compared else ("position_error", "Position error [m]")
    flagged, errors, smallest = map(verification.gathered, ("flagged", name, "conditioning"))
    starts = np.cumsum([0, *(len(each.status) for each in verification.episodes)]).tolist()
    figure = Figure(figsize=(10.0, 3.0 * len(verification.arms)))
    axes = figure.subplots(len(verification.arms), 2, squeeze=False)
    for arm, (arm_label, (left, right)) in enumerate(zip(verification.arms, axes, strict=True)):
        for axis in (left, right):
            axis.set(xlabel="Frame", xlim=(0, starts[-1]))
            for start in starts[1:-1] if len(starts) <= SEPARATED else ():
                axis.axvline(start, color=GRID, linewidth=0.6, zorder=0)
        _draw_errors(left, errors[arm], flagged[arm].astype(bool))
        left.set(title=f"{arm_label}: round trip", ylabel=label)
        _draw_conditioning(right, smallest[arm], starts)
        right.set(title=f"{arm_label}: smallest singular value", ylabel="Metres and radians mixed")
    figure.suptitle(title)
    return figure


def _draw_errors(axis: Axes, errors: Array, flagged: Flags) -> None:
    for chosen, colour, label in ((~flagged, BLUE, "not flagged"), (flagged, ORANGE, "flagged")):
        if chosen.any():
            frames, shown = np.flatnonzero(chosen), np.maximum(errors[chosen], FLOOR)
            axis.plot(frames, shown, ".", markersize=2, color=colour, label=label, rasterized=True)
    axis.axhline(EXACT, color=GREY, linewidth=0.8, linestyle="--")
    axis.set_yscale("log")
    axis.legend(loc="upper right", markerscale=4)


def _draw_conditioning(axis: Axes, smallest: Array, starts: list[int]) -> None:
    if not np.all(np.isfinite(smallest)):
        axis.text(0.5, 0.5, "joint space: none", transform=axis.transAxes, ha="center")
        return
    for first, stop in itertools.pairwise(starts):
        axis.plot(range(first, stop), smallest[first:stop], linewidth=0.6, color=GREEN, rasterized=True)
    axis.axhline(SINGULAR, color=GREY, linewidth=0.8, linestyle="--")
    axis.set_ylim(bottom=0)
