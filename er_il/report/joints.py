"""The study of ERJ's joints: its figure, its table and what follows from it, rendered from its report alone."""

import itertools
from collections.abc import Sequence
from statistics import mean

import pandas as pd
from matplotlib.figure import Figure

from er_il.report.charts import bar_chart, percent_axis
from er_il.report.style import BLUE, GREEN, GREY, INK, ORANGE, OTHERS, PURPLE, RED, SKY, Look, legend, styled
from er_il.report.tables import joined, markdown_table
from er_il.report.text import Report, sentences, table

WORKSPACE = "workspace"  # the set of configurations beside the sets of demonstrations
CROWDED = 10  # choices, above which labels stand upright
SMALLEST = 1e-4  # singular values below are drawn here: a logarithmic axis needs one
COLOURS = (GREY, BLUE, ORANGE, GREEN, PURPLE, SKY, RED, *OTHERS)  # the workspace first, then the sets


def measures(report: Report) -> dict[str, dict[str, Report]]:
    """Measures of each choice, by its name, over the workspace and along each set of demonstrations."""
    sets = {WORKSPACE: report["workspace"], **report["demos"]}
    return {name: {joined(each["joints"]): each for each in of_set} for name, of_set in sets.items()}


def risks(report: Report) -> dict[str, float]:
    """Risk of each choice: its mean over the demonstrations if there are any, else over the workspace."""
    sets = measures(report)
    decisive = [sets[name] for name in report["demos"] or (WORKSPACE,)]
    return {name: mean(of_set[name]["risk"] for of_set in decisive) for name in decisive[0]}


def notes(report: Report) -> list[str]:
    """Sentences that say which joints to command and avoid, and why; and, if there, how trained policies compare."""
    return sentences("joint_notes.txt.j2", report=report, sets=measures(report), risks=risks(report))


def choices_texts(report: Report, choices: Sequence[str]) -> pd.DataFrame:
    """Texts of the study's table, a row per name of a choice."""
    return table("joints", report=report, sets=measures(report), risks=risks(report), choices=choices)


def advice_texts(report: Report) -> pd.DataFrame:
    """Texts of the study's table, the best choices first."""
    return choices_texts(report, list(map(joined, report["ranking"])))


def joints_table(report: Report) -> str:
    """Every choice of joints, the best first; then the notes."""
    risk = risks(report)
    listed = "\n".join(f"- {note}" for note in notes(report))
    return f"{markdown_table(choices_texts(report, sorted(risk, key=risk.__getitem__)))}\n\n{listed}"


@styled
def joints_figure(report: Report) -> Figure:
    """Each choice of joints: self-motion, singularities, risk, round trips, playback and, if there, training."""
    crowded, settings = len(report["workspace"]) > CROWDED, report["settings"]
    labels = _labels(report, "{} ({})" if crowded else "{}\n{}")
    data = pd.DataFrame(
        [{"series": name, **each} for name, of_set in measures(report).items() for each in of_set.values()]
    )
    data["group"] = data["joints"].map(joined).map(labels.get)
    tested = [{"series": each["task"], **row} for each in report.get("training", []) for row in each["choices"]]
    trained = pd.DataFrame(tested, columns=pd.Index(["series", "joints", "success", "interval"]))
    flips = data.loc[data["series"] != WORKSPACE]
    low, median = (data[key].clip(lower=SMALLEST) for key in ("smallest_p05", "smallest_p50"))
    seed, action = settings["seed_error_rad"], 1e3 * settings["playback_error_m"]
    panels = {
        "Share of the joint in the self-motion's speed": data.assign(value=data["self_motion"]),
        "Smallest singular value (median, 5th percentile)": data.assign(value=median, low=low, high=median),
        "Risk: near a singularity or joints lost [%]": data.assign(value=100 * data["risk"]),
        f"Round trips missed [%], seed error {seed} rad": data.assign(value=100 * data["missed"]),
        f"Branch flips per demonstration, action error {action:.0f} mm": flips.assign(value=flips["flips"]),
        "Success of ACT policies trained with it [%]": trained.assign(
            group=trained["joints"].map(labels.get),
            value=100 * trained["success"],
            low=100 * trained["interval"].str[0],
            high=100 * trained["interval"].str[1],
        ),
    }
    panels = {title: panel for title, panel in panels.items() if len(panel)}
    columns = -(-len(panels) // 2)
    figure = Figure(figsize=(4.6 * columns, 6.4))
    names = pd.concat(panels.values())["series"].unique()
    looks = {name: Look(name, colour) for name, colour in zip(names, itertools.cycle(COLOURS), strict=False)}
    for place, (title, panel) in enumerate(panels.items(), start=1):
        axis = figure.add_subplot(2, columns, place)
        bar_chart(axis, panel, {name: look for name, look in looks.items() if name in set(panel["series"])})
        axis.set(title=title, xlabel="Commanded joint")
        if title.startswith(("Risk", "Success")):
            percent_axis(axis)
        if crowded:
            axis.tick_params("x", rotation=90, labelsize=6)
    figure.axes[1].set_yscale("log")
    figure.axes[1].axhline(settings["singular"], color=INK, linestyle="--", linewidth=0.9)
    legend(figure, below=True)
    best = joined(report["recommended"])
    figure.suptitle(f"Which joint should ERJ command on {report['arm']}? Recommended: {best}", x=0.01, ha="left")
    return figure


def _labels(report: Report, form: str) -> dict[str, str]:
    """Label of each choice: its joints without the common prefix, and whether they twist or bend."""
    alike = itertools.takewhile(lambda letters: len(set(letters)) == 1, zip(*report["joints"], strict=False))
    shared = len(list(alike))
    found = {}
    for each in report["workspace"]:
        kinds = {"twists" if joint in report["twisting"] else "bends" for joint in each["joints"]}
        short = "+".join(joint[shared:] or joint for joint in each["joints"])
        found[joined(each["joints"])] = form.format(short, kinds.pop() if len(kinds) == 1 else "mixed")
    return found
