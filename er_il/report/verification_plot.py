"""The picture of a verification: errors of the round trip, and distance from singularities, frame by frame."""

import itertools
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from er_il.datasets.verification import Verification
from er_il.spaces.round_trip import EXACT, SINGULAR

FLOOR = 1e-9  # [rad] errors below are drawn here: a logarithm needs one
WIDTH, HEIGHT = 10.0, 3.0  # [inch] of a row


def plot(verification: Verification, path: Path, title: str) -> None:
    """Draw a row an arm: joint errors (flagged frames apart) and the smallest singular value."""
    arms = verification.arms
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(WIDTH, HEIGHT * len(arms)), layout="constrained")
        axes = figure.subplots(len(arms), 2, squeeze=False)
        starts = np.cumsum([0, *(len(each.status) for each in verification.episodes)])
        flagged = verification.gathered("flagged")
        errors = verification.gathered("error" if verification.compared else "position_error")
        for arm, label in enumerate(arms):
            frames, flags = np.arange(starts[-1]), flagged[arm].astype(bool)
            left, right = axes[arm]
            for chosen, colour, name in ((~flags, "tab:blue", "clear"), (flags, "tab:orange", "flagged")):
                if not chosen.any():
                    continue
                shown = np.maximum(errors[arm][chosen], FLOOR)
                left.plot(frames[chosen], shown, ".", markersize=2, color=colour, label=name, rasterized=True)
            left.axhline(EXACT, color="grey", linewidth=0.8, linestyle="--")
            unit = "joint error [rad]" if verification.compared else "position error [m]"
            left.set(yscale="log", ylabel=unit, title=f"{label}: round trip")
            left.legend(loc="upper right", markerscale=4)
            sigma = verification.gathered("conditioning")[arm]
            right.set(title=f"{label}: smallest singular value", ylabel="m and rad mixed")
            if np.all(np.isfinite(sigma)):
                for first, stop in itertools.pairwise(starts.tolist()):
                    right.plot(frames[first:stop], sigma[first:stop], linewidth=0.6, color="tab:green", rasterized=True)
                right.axhline(SINGULAR, color="grey", linewidth=0.8, linestyle="--")
                right.set_ylim(bottom=0)
            else:
                right.text(0.5, 0.5, "joint space: none", transform=right.transAxes, ha="center")
            for axis in (left, right):
                axis.set(xlabel="frame", xlim=(0, starts[-1]))
                if len(starts) <= 60:  # more episodes would be a grey wall
                    for start in starts[1:-1]:
                        axis.axvline(start, color="0.9", linewidth=0.6, zorder=0)
        figure.suptitle(title)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
