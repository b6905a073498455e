"""The study of ERJ's joints: its figure, its table and what follows from it, rendered from its report alone."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from er_il.report.charts import bar_chart, percent_axis, where
from er_il.report.style import BLUE, GREEN, GREY, INK, ORANGE, OTHERS, PURPLE, RED, SKY, Look, legend, styled
from er_il.report.tables import joined, markdown_table, table
from er_il.report.text import sentences

Report = Mapping[str, Any]

WORKSPACE = "workspace"  # the set of configurations beside the sets of demonstrations
CROWDED = 10  # choices, above which labels stand upright
SMALLEST = 1e-4  # singular values below are drawn here: a logarithmic axis needs one
COLOURS = (GREY, BLUE, ORANGE, GREEN, PURPLE, SKY, RED, *OTHERS)  # the workspace first, then the sets


def measures(report: Report) -> pd.DataFrame:
    """A row per set and choice: the set (``series``), the choice's ``name`` and label (``group``), and its measures."""
    sets = {WORKSPACE: report["workspace"], **report["demos"]}
    data = pd.DataFrame([{"series": name, **each} for name, of_set in sets.items() for each in of_set])
    names, labels = [joined(choice) for choice in data["joints"]], _labels(report)
    return data.assign(name=names, group=[labels[name] for name in names])


def risks(report: Report) -> dict[str, float]:
    """Risk of each choice: its mean over the demonstrations if there are any, else over the workspace."""
    data = measures(report)
    decisive = data["series"] != WORKSPACE if report["demos"] else slice(None)
    return data.loc[decisive].groupby("name", sort=False)["risk"].mean().to_dict()


def notes(report: Report) -> list[str]:
    """Sentences that say which joints to command, why, which to avoid, and where singularities are near."""
    data = measures(report)
    best = where(data, name=joined(report["recommended"]))
    shares = {joined(each["joints"]): each["self_motion"] for each in report["workspace"]}
    return sentences(
        "joint_notes.txt.j2",
        report=report,
        names=[joined(choice) for choice in report["ranking"]],
        default=joined(report["default"]),
        risks=risks(report),
        over=where(best, series=WORKSPACE).iloc[0],
        along=best.loc[best["series"] != WORKSPACE].to_dict("records"),
        single=all(len(choice) == 1 for choice in report["ranking"]),
        twisting={name: share for name, share in shares.items() if name in report["twisting"]},
        bending={name: share for name, share in shares.items() if name not in report["twisting"]},
    )


def training_notes(report: Report) -> list[str]:
    """Sentences that compare the advice with trained policies, one per task."""
    return sentences("joint_training.txt.j2", training=report.get("training", []))


def choices_texts(report: Report, choices: Sequence[Sequence[str]]) -> pd.DataFrame:
    """Texts of the study's table, a row per choice of joints."""
    data, risk = measures(report), risks(report)
    of_choice = {name: part.set_index("series").to_dict("index") for name, part in data.groupby("name")}
    rows = [{"name": name, "risk": risk[name], "sets": of_choice[name]} for name in map(joined, choices)]
    return table("joints", rows, demos=list(report["demos"]))


def joints_table(report: Report) -> str:
    """Every choice of joints, the best first; then the notes."""
    risk = risks(report)
    choices = sorted((each["joints"] for each in report["workspace"]), key=lambda choice: risk[joined(choice)])
    listed = "\n".join(f"- {note}" for note in [*notes(report), *training_notes(report)])
    return f"{markdown_table(choices_texts(report, choices))}\n\n{listed}"


@styled
def joints_figure(report: Report) -> Figure:
    """Each choice of joints: self-motion, singularities, risk, round trips, playback and, if there, training."""
    data, settings = measures(report), report["settings"]
    low, middle = (data[key].clip(lower=SMALLEST) for key in ("smallest_p05", "smallest_p50"))
    seed, action = settings["seed_error_rad"], 1e3 * settings["playback_error_m"]
    panels = {
        "Share of the joint in the self-motion's speed": data.assign(value=data["self_motion"]),
        "Smallest singular value (median, 5th percentile)": data.assign(value=middle, low=low, high=middle),
        "Risk: near a singularity or joints lost [%]": data.assign(value=100 * data["risk"]),
        f"Round trips missed [%], seed error {seed} rad": data.assign(value=100 * data["missed"]),
        f"Branch flips per demonstration, action error {action:.0f} mm": data.assign(value=data["flips"]).dropna(
            subset="value"
        ),
        "Success of ACT policies trained with it [%]": _training(report),
    }
    panels = {title: panel for title, panel in panels.items() if len(panel)}
    columns = -(-len(panels) // 2)
    figure = Figure(figsize=(4.6 * columns, 6.4))
    axes = figure.subplots(2, columns, squeeze=False).ravel()
    names = pd.concat(panels.values())["series"].unique()
    looks = {name: Look(name, colour) for name, colour in zip(names, itertools.cycle(COLOURS), strict=False)}
    for axis, (title, panel) in zip(axes, panels.items(), strict=False):
        bar_chart(axis, panel, {name: look for name, look in looks.items() if name in set(panel["series"])})
        axis.set(title=title, xlabel="Commanded joint")
        if title.startswith(("Risk", "Success")):
            percent_axis(axis)
        if _crowded(report):
            axis.tick_params("x", rotation=90, labelsize=6)
    for empty in axes[len(panels) :]:
        empty.set_axis_off()
    axes[1].set_yscale("log")
    axes[1].axhline(settings["singular"], color=INK, linestyle="--", linewidth=0.9)
    legend(figure, *axes[: len(panels)], below=True)
    best = joined(report["recommended"])
    figure.suptitle(f"Which joint should ERJ command on {report['arm']}? Recommended: {best}", x=0.01, ha="left")
    return figure


def _training(report: Report) -> pd.DataFrame:
    """Success in percent of each task and choice that was trained."""
    labels = _labels(report)
    rows = [
        {"series": each["task"], "group": labels[row["joints"]], "value": 100 * row["success"]}
        | dict(zip(("low", "high"), (100 * bound for bound in row["interval"]), strict=True))
        for each in report.get("training", [])
        for row in each["choices"]
    ]
    return pd.DataFrame(rows)


def _crowded(report: Report) -> bool:
    return len(report["workspace"]) > CROWDED


def _labels(report: Report) -> dict[str, str]:
    """Label of each choice: its joints without the common prefix, and whether they twist or bend."""
    alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*report["joints"], strict=False))
    shared = len(list(alike))
    found = {}
    for each in report["workspace"]:
        kinds = {"twists" if joint in report["twisting"] else "bends" for joint in each["joints"]}
        short = "+".join(joint[shared:] or joint for joint in each["joints"])
        kind = kinds.pop() if len(kinds) == 1 else "mixed"
        found[joined(each["joints"])] = f"{short} ({kind})" if _crowded(report) else f"{short}\n{kind}"
    return found
