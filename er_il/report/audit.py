"""The audit of a dataset: its figures and its page, from its report alone."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from er_il.evaluation.task_drift import DECODERS, MEAN
from er_il.report.elbow_verdict import SAME
from er_il.report.margins import FITTED
from er_il.report.style import BAD, BLUE, DASHED, GREEN, GREY, GRID, INK, LOOKS, Look, legend, save, styled
from er_il.report.text import Report, render
from er_il.spaces.registry import ERA, ERJ, ERX

# Of the decoders, and of the recording; yellow lines are hard to see.
RECORDED = "recorded"
LOOKS_OF = {RECORDED: Look("Recorded", INK), **{name: LOOKS[name] for name in DECODERS}}
LOOKS_OF[MEAN] = Look(LOOKS[MEAN].label, BLUE)
SEPARATED = 60  # episodes at most between which lines are drawn


def recommendation(report: Report) -> str:
    """The recommendation in plain words, for the terminal."""
    text = render("audit_recommendation.md.j2", **_values("", report))
    return re.sub(r"\*\*|`", "", text).strip()


def write_page(folder: Path, label: str, report: Report, source: str) -> Path:
    """Write the pictures and the page of one arm, and return the page; all names start with the arm's label, if any."""
    start = f"{label}_" if label else ""
    pictures = {"elbow": elbow_figure, "folds": folds_figure}
    if report["spread"]["pairs"]:
        pictures["spread"] = spread_figure
    for name, draw in pictures.items():
        save(draw(report), folder / f"{start}{name}.png")
    page = folder / f"{start}README.md"
    page.write_text(render("audit.md.j2", source=source, **_values(start, report)))
    return page


def _values(start: str, report: Report) -> dict[str, Any]:
    kind = {FITTED: ERX, ERA: ERA}.get(report["verdict"]["space"], ERJ)
    return {"start": start, "kind": kind, "looks": {name: LOOKS[name].label for name in DECODERS}, **report}


@styled
def elbow_figure(report: Report) -> Figure:
    """The arm where task space is farthest from the recording, from the side and from above; the drift over time."""
    figure = Figure(figsize=(11.0, 3.9))
    side, above, curves = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.5))
    scene, best = report["scene"], report["verdict"]["decoder"]
    hand = np.array(scene["hand"])
    for axis, (i, j), title in ((side, (0, 2), "From the side"), (above, (0, 1), "From above")):
        axis.plot(hand[:, i], hand[:, j], color=GREY, linewidth=1, linestyle=DASHED, label="Way of the hand")
        for name, width in ((RECORDED, 4.5), (best, 2.5)):
            points, look = np.array([scene["base"], *scene["arms"][name]]), LOOKS_OF[name]
            axis.plot(points[:, i], points[:, j], "o-", color=look.colour, linewidth=width, label=look.label, zorder=3)
        axis.set(xlabel="x [m]", ylabel="yz"[j - 1] + " [m]", title=title)
        axis.set_aspect("equal", adjustable="datalim")
        axis.grid(axis="x")
    for name in DECODERS:
        look = LOOKS_OF[name]
        for i, curve in enumerate(report["drift"][name]["curves_m"]):
            seconds = np.arange(len(curve)) / report["fps"]
            shown = {"label": look.label} if i == 0 else {}
            curves.plot(seconds, 100 * np.array(curve), color=look.colour, linewidth=0.9, alpha=0.8, **shown)
    curves.axhline(100 * SAME, color=GREY, linestyle="--", linewidth=1.0, label="Counts as the same place")
    curves.set(xlabel="Time [s]", ylabel="[cm]", title="Distance of the elbow from the recorded one", ylim=(0, None))
    legend(figure, below=True)
    figure.suptitle(
        "Only the hand's pose is followed. Left: where the elbow is off most "
        f"(episode {scene['episode']}, step {scene['step']}); right: all episodes",
        x=0.01,
        ha="left",
    )
    return figure


@styled
def spread_figure(report: Report) -> Figure:
    """The spread of the elbow at the same pose beside the room that it has; each episode's difference from others."""
    figure = Figure(figsize=(11.0, 3.4))
    left, right = figure.subplots(1, 2)
    curve = report["spread"]["curve"]
    share = 100 * np.array(curve["share"])
    room, deviation = (np.array(curve[key], dtype=float) for key in ("room_rad", "deviation_rad"))
    left.fill_between(share, -room / 2, room / 2, color=GRID, label="Room: where the elbow could be", linewidth=0)
    left.fill_between(share, -deviation, deviation, color=GREEN, label="Demonstrations (± one standard deviation)")
    left.set(xlabel="Time [% of the episode]", ylabel="Self-motion [rad]", title="Elbows at the same pose of the hand")
    _bars(right, report)
    legend(figure, below=True)
    return figure


def _bars(axis: Axes, report: Report) -> None:
    odd = report["verdict"]["odd_episodes"]
    differences = report["spread"]["of_episode_m"]
    numbers = [each["episode"] for each in report["episodes"]]
    for chosen, colour, label in ((False, GREEN, "Episodes"), (True, BAD, "Odd episodes")):
        rows = [i for i, number in enumerate(numbers) if (number in odd) == chosen and differences[i] is not None]
        if rows:
            axis.bar(rows, [100 * differences[i] for i in rows], color=colour, label=label if chosen else None)
    axis.axhline(100 * SAME, color=GREY, linestyle="--", linewidth=1.0, label="Counts as the same place")
    axis.set_xticks(range(len(numbers)), [str(number) for number in numbers])
    axis.set(xlabel="Episode", ylabel="[cm]", title="Elbow of each episode from those of others (median)")
    axis.set_ylim(0, max(100 * SAME * 1.2, *(115 * each for each in differences if each is not None), 0))


@styled
def folds_figure(report: Report) -> Figure:
    """Margin from folds of every space along all episodes, one after the other."""
    rows = sorted(report["spaces"], key=lambda row: (row["risk"], -row["smallest"]))
    figure = Figure(figsize=(11.0, 1.3 + 0.26 * len(rows)))
    axis = figure.subplots()
    picture = axis.imshow(
        [row["curve"] for row in rows], aspect="auto", cmap="RdYlBu", vmin=0.0, vmax=0.6, interpolation="nearest"
    )
    ends = np.cumsum([each["frames"] for each in report["episodes"]])
    for end in ends[:-1] if len(ends) <= SEPARATED else ():
        axis.axvline(end - 0.5, color="white", linewidth=1.2)
    middles = ends - np.array([each["frames"] for each in report["episodes"]]) / 2
    shown = max(1, len(ends) // 20)
    axis.set_xticks(middles[::shown], [str(each["episode"]) for each in report["episodes"]][::shown])
    axis.set_yticks(range(len(rows)), [row["space"] for row in rows])
    axis.set(
        xlabel="Episode", title="Margin from folds, step by step: red is at a fold, where two elbows share an action"
    )
    axis.grid(visible=False)
    figure.colorbar(picture, ax=axis, extend="max", label="Margin")
    return figure
