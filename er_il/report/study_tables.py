"""The studies' results as Markdown, rendered from their reports alone."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Any

from er_il.experiments.studies.joint_notes import joined, risks, training_notes
from er_il.experiments.studies.validity import SPACES
from er_il.experiments.studies.validity_report import shares
from er_il.report.markdown import markdown_table

Report = Mapping[str, Any]

AROUND = {"demos": "demonstrations", "random": "random states"}


def validity_table(report: Report) -> str:
    """Invalid share of each space by cause, and what decoding costs; then the findings."""
    headings = ["Around", "Solver", "Space", "Invalid", "95 % interval", "Causes", "Iterations", "Decode p50 / p99"]
    rows = []
    for around, damped, space in itertools.product(AROUND, (True, False), SPACES):
        share, low, high = shares(report["pooled"], around, damped)[space]
        pooled = [
            row for row in report["pooled"] if (row["around"], row["damped"], row["space"]) == (around, damped, space)
        ]
        actions = sum(row["actions"] for row in pooled)
        causes = {cause: sum(row["causes"][cause] for row in pooled) / actions for cause in pooled[0]["causes"]}
        p50, p99, most = (max(row[k] for row in pooled) for k in ("decode_p50_ms", "decode_p99_ms", "iterations_p99"))
        rows.append(
            [
                AROUND[around],
                "damped" if damped else "undamped",
                space,
                f"**{share:.0%}**",
                f"{low:.0%} – {high:.0%}",
                ", ".join(f"{cause.replace('_', ' ')} {part:.0%}" for cause, part in causes.items() if part >= 0.005),
                f"p99 {most:.0f}",
                f"{p50:.1f} / {p99:.1f} ms",
            ]
        )
    return f"{markdown_table(headings, rows)}\n\n{_list(report['findings'])}"


def joints_table(report: Report) -> str:
    """Every choice of joints, the best first; then what follows, and how training bears it out."""
    headings = ["Commanded", "Self-motion", "Near singular", "Round trips back"]
    headings += [f"`{name}`: at risk (flips)" for name in report["demos"]]
    workspace, demos = _by_joints(report["workspace"]), [_by_joints(of_set) for of_set in report["demos"].values()]
    rows = []
    for name in sorted(workspace, key=lambda each: risks(report)[each]):
        each = workspace[name]
        row = [f"`{name}`", f"{each['self_motion']:.2f}", f"{each['near_singular']:.0%}", f"{1 - each['missed']:.1%}"]
        row += [f"{of_set[name]['risk']:.0%} ({of_set[name]['flips']:.1f})" for of_set in demos]
        rows.append(row)
    return f"{markdown_table(headings, rows)}\n\n{_list([*report['notes'], *training_notes(report)])}"


def deltas_table(report: Report) -> str:
    """How far adding up deltas leads away from demonstrations."""
    headings = ["Space", "Steps (longest demo)", "Invalid", "Joints off by", "End effector off by"]
    rows = [
        [
            each["space"],
            f"{each['steps']} ({each['longest']})",
            str(each["invalid"]),
            f"{each['joints']:.0e} rad",
            f"{1e3 * each['position']:.0e} mm, {each['rotation']:.0e} rad",
        ]
        for each in report["drifts"]
    ]
    return markdown_table(headings, rows)


def training_time_table(report: Report) -> str:
    """What a batch takes to load, and a step to update the policy, by LeRobot's own command and by er_il's."""
    headings = ["Inputs", "Command", "Load a batch", "Update the policy", "Loading, of all", "Steps a second"]
    rows = [
        [
            f"{each['inputs']}, batch {each['batch']}",
            each["command"],
            f"{1e3 * each['load_s']:.0f} ms",
            f"{1e3 * each['update_s']:.0f} ms",
            f"{each['load_s'] / (each['load_s'] + each['update_s']):.0%}",
            f"{1 / (each['load_s'] + each['update_s']):.1f}",
        ]
        for each in report["training_times"]
    ]
    return markdown_table(headings, rows)


def _by_joints(fitness: Iterable[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    return {joined(each["joints"]): each for each in fitness}


def _list(sentences: Iterable[str]) -> str:
    return "\n".join(f"- {sentence}" for sentence in sentences)
