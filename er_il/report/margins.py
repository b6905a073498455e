"""The study of margins: its figure, its table and what follows from it, rendered from its report alone."""

from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from er_il.report.charts import bar_chart
from er_il.report.style import BLUE, GREY, INK, OTHERS, Look, legend, styled
from er_il.report.tables import markdown_table
from er_il.report.text import Report, sentences, table

PRESET, FITTED = "erx", "erx (fitted)"  # ERX with the arm's own weights, and with those fitted to the demonstrations
SPECIAL = ("era", "era@stereo", PRESET, FITTED)  # spaces of the report that command no joints


def by_demos(report: Report) -> dict[str, dict[str, Report]]:
    """Measures of each space by its label, along each set of demonstrations."""
    sets: dict[str, dict[str, Any]] = {}
    for row in report["margins"]:
        sets.setdefault(row["demos"], {})[row["space"]] = row
    return sets


def best_joints(of_set: dict[str, Report]) -> str:
    """The choice of ERJ's joints with the largest smallest margin along a set of demonstrations."""
    return max((name for name in of_set if name not in SPECIAL), key=lambda name: of_set[name]["smallest"])


def notes(report: Report) -> list[str]:
    """Sentences that say how far each space is from its folds, and what motion ERX's coordinates measure."""
    sets = by_demos(report)
    best = {name: best_joints(of_set) for name, of_set in sets.items()}
    return sentences("margin_notes.txt.j2", report=report, sets=sets, best=best, fitted=FITTED, preset=PRESET)


def margins_texts(report: Report) -> pd.DataFrame:
    """Texts of the study's table, a row per space, the one first that stays farthest from its folds everywhere."""
    sets = by_demos(report)
    return table("margins", sets=sets, spaces=_ranked(sets))


def playback_texts(report: Report) -> pd.DataFrame:
    """Texts of what IK meets along the demonstrations: conditioning and changes of branch, in the same order."""
    sets = by_demos(report)
    return table("playback", sets=sets, spaces=_ranked(sets))


def margins_table(report: Report) -> str:
    """The margins of every space along each set of demonstrations, conditioning and flips; then the notes."""
    listed = "\n".join(f"- {note}" for note in notes(report))
    tables = (margins_texts(report), playback_texts(report))
    return "\n\n".join([*map(markdown_table, tables), listed])


def _ranked(sets: dict[str, dict[str, Report]]) -> list[str]:
    """The spaces, the one first whose smallest margin of all is the largest."""
    smallest = {
        space: min(of_set[space]["smallest"] for of_set in sets.values()) for space in next(iter(sets.values()))
    }
    return sorted(smallest, key=smallest.__getitem__, reverse=True)


@styled
def margins_figure(report: Report) -> Figure:
    """The smallest margin of each space along each set of demonstrations, and ERX's weights joint by joint."""
    count = len(report["coordinates"][0]["weights"])
    figure = Figure(figsize=(9.0, 3.0 + 2.4 * count))
    axes = figure.subplots(1 + count, 1)
    sets = list(by_demos(report))
    looks = {name: Look(name, colour) for name, colour in zip(sets, (BLUE, *OTHERS * len(sets)), strict=False)}
    smallest = pd.DataFrame(report["margins"]).rename(columns={"space": "group", "demos": "series"})
    axis = axes[0]
    bar_chart(axis, smallest.assign(value=smallest["smallest"]), looks)
    axis.set(ylabel="Smallest margin", ylim=(0.0, 1.0), title="Margin from folds along the demonstrations")
    axis.tick_params("x", rotation=20)
    for row, axis in enumerate(axes[1:]):
        weights = [
            {"series": each["demos"], "group": joint, "value": weight}
            for each in report["coordinates"]
            for joint, weight in zip(report["joints"], each["weights"][row], strict=True)
        ]
        bar_chart(axis, pd.DataFrame(weights).fillna({"series": ""}), {"": Look("no demonstrations", GREY)} | looks)
        axis.axhline(0.0, color=INK, linewidth=0.9)
        which = "" if count == 1 else f", coordinate {row + 1}"
        axis.set(ylabel="Weight in W", title=f"What ERX measures{which}: the weight of each joint")
        axis.tick_params("x", rotation=20)
    legend(figure, below=True)
    return figure
