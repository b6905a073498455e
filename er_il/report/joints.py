"""The study of ERJ's joints: its figure, its table and what follows from it, rendered from its report alone."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from er_il.report.charts import bar_chart, percent_axis
from er_il.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    OTHERS,
    PURPLE,
    RED,
    SKY,
    Look,
    legend,
    new_figure,
    styled,
)
from er_il.report.tables import Columns, joined, markdown_table
from er_il.report.text import sentences

Report = Mapping[str, Any]
Fitness = Mapping[str, Any]

UNFIT = 0.4  # risk of a choice along demonstrations above which it is unsuitable
SHOWN = 5  # intervals near singularities that are named
CROWDED = 10  # choices, above which labels stand upright
RISK, TRAINING = "Risk: near a singularity or joints lost [%]", "Success of ACT policies trained with it [%]"
SMALLEST = 1e-4  # singular values below are drawn here: a logarithmic axis needs one
COLOURS = (GREY, BLUE, ORANGE, GREEN, PURPLE, SKY, RED, *OTHERS)  # the workspace first, then the sets


def risks(report: Report) -> dict[str, float]:
    """Risk of each choice: its mean over the demonstrations if there are any, else over the workspace."""
    sets = list(report["demos"].values()) or [report["workspace"]]
    return {
        joined(each["joints"]): sum(of_set[i]["risk"] for of_set in sets) / len(sets) for i, each in enumerate(sets[0])
    }


def notes(report: Report) -> list[str]:
    """Sentences that say which joints to command, why, which to avoid, and where singularities are near."""
    best, second = (joined(choice) for choice in report["ranking"][:2])
    along = [_of(of_set, report["recommended"]) for of_set in report["demos"].values()]
    return sentences(
        "joint_notes.txt.j2",
        report=report,
        best=best,
        second=second,
        default=joined(report["default"]),
        risks=risks(report),
        unfit={name: risk for name, risk in risks(report).items() if risk >= UNFIT} if along else {},
        accuracy=1 - _of(report["workspace"], report["recommended"])["missed"],
        structure=_structure(report),
        smallest=min((each["smallest_p05"] for each in along), default=None),
        folds=sum(each["folds"] for each in along) / max(1, len(along)),
        shown=SHOWN,
    )


def training_notes(report: Report) -> list[str]:
    """Sentences that compare the advice with trained policies, one per task."""
    return sentences("joint_training.txt.j2", training=report.get("training", []))


def joint_columns(report: Report) -> Columns:
    """Columns of the study, a row per choice (a member of ``report["ranking"]``)."""

    def over(column: Callable[[Fitness], str], of_set: Sequence[Fitness]) -> Callable[[Sequence[str]], str]:
        return lambda choice: column(_of(of_set, choice))

    workspace, risk = report["workspace"], risks(report)
    return {
        "Commanded": lambda choice: f"`{joined(choice)}`",
        "Risk": lambda choice: f"{risk[joined(choice)]:.1%}",
        "Self-motion": over(lambda each: f"{each['self_motion']:.2f}", workspace),
        "Near singular": over(lambda each: f"{each['near_singular']:.0%}", workspace),
        "Round-trip accuracy": over(lambda each: f"{1 - each['missed']:.1%}", workspace),
        **{
            f"`{name}`: risk (flips)": over(lambda each: f"{each['risk']:.0%} ({each['flips']:.1f})", of_set)
            for name, of_set in report["demos"].items()
        },
    }


def joints_table(report: Report) -> str:
    """Every choice of joints, the best first; then the notes."""
    risk = risks(report)
    choices = sorted((each["joints"] for each in report["workspace"]), key=lambda choice: risk[joined(choice)])
    listed = "\n".join(f"- {note}" for note in [*notes(report), *training_notes(report)])
    return f"{markdown_table(choices, joint_columns(report))}\n\n{listed}"


@styled
def joints_figure(report: Report) -> Figure:
    """Each choice of joints: self-motion, singularities, risk, round trips, playback and, if there, training."""
    data, settings = _data(report), report["settings"]
    looks = {name: Look(name, colour) for name, colour in zip(dict.fromkeys(data["series"]), COLOURS, strict=False)}
    error, seed = 1e3 * settings["playback_error_m"], settings["seed_error_rad"]
    demos = data.loc[data["series"] != "workspace"]
    panels: list[tuple[str, pd.DataFrame]] = [
        ("Share of the joint in the self-motion's speed", data.assign(value=data["self_motion"])),
        ("Smallest singular value (median, 5th percentile)", _singular_values(data)),
        (RISK, data.assign(value=100 * data["risk"])),
        (f"Round trips missed [%], seed error {seed} rad", data.assign(value=100 * data["missed"])),
    ]
    if report["demos"]:
        title = f"Branch flips per demonstration, action error {error:.0f} mm"
        panels.append((title, demos.assign(value=data["flips"])))
    if report.get("training"):
        panels.append((TRAINING, _training(report)))
    columns = -(-len(panels) // 2)
    figure = new_figure(4.6 * columns, 6.4)
    axes = figure.subplots(2, columns, squeeze=False).ravel()
    for axis, (title, panel) in zip(axes, panels, strict=False):
        bar_chart(axis, panel, {name: look for name, look in looks.items() if name in set(panel["series"])})
        axis.set(title=title, xlabel="Commanded joint")
        if title in (RISK, TRAINING):
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


def _data(report: Report) -> pd.DataFrame:
    """A row per choice and set."""
    sets = {"workspace": report["workspace"], **report["demos"]}
    groups = _labels(report)
    return pd.DataFrame(
        [{**each, "group": groups[joined(each["joints"])], "series": name} for name in sets for each in sets[name]]
    )


def _singular_values(data: pd.DataFrame) -> pd.DataFrame:
    low, middle = (data[key].clip(lower=SMALLEST) for key in ("smallest_p05", "smallest_p50"))
    return data.assign(value=middle, low=low, high=middle)


def _training(report: Report) -> pd.DataFrame:
    groups = _labels(report)
    return pd.DataFrame(
        [
            {
                "group": groups[row["joints"]],
                "series": prediction["task"],
                "value": 100 * row["success"],
                "low": 100 * row["interval"][0],
                "high": 100 * row["interval"][1],
            }
            for prediction in report["training"]
            for row in prediction["choices"]
        ]
    )


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


def _structure(report: Report) -> dict[str, Any]:
    """Self-motion of the joints that twist and of those that bend, if every one of the former has more of it."""
    if any(len(each["joints"]) != 1 for each in report["workspace"]):
        return {}
    shares = {each["joints"][0]: each["self_motion"] for each in report["workspace"]}
    twisting = {joint: share for joint, share in shares.items() if joint in report["twisting"]}
    bending = {joint: share for joint, share in shares.items() if joint not in report["twisting"]}
    clear = bool(twisting and bending) and min(twisting.values()) > max(bending.values())
    return {"twisting": twisting, "bending": bending} if clear else {}


def _of(of_set: Sequence[Fitness], choice: Sequence[str]) -> Fitness:
    return next(each for each in of_set if list(each["joints"]) == list(choice))
