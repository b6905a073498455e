"""A report of results as a chart and a page, rendered from the JSON alone."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from er_il.report.markdown import markdown_table
from er_il.support.counts import tally

REPORT, CHART, PAGE = "report.json", "success.png", "report.md"
PICTURES = (".png", ".webp")  # shown on the page; other files are linked
_LABELS = {
    "joint": "Joint",
    "erj": "ERJ",
    "era": "ERA",
    "task-nearest": "Task\n(nearest)",
    "task-posture": "Task\n(posture)",
    "task-mean": "Task\n(mean posture)",
    "task-grasp": "Task\n(grasp posture)",
}
# Okabe and Ito's palette: told apart by every eye.
COLOURS = {
    "joint": "#56B4E9",
    "erj": "#009E73",
    "era": "#CC79A7",
    "task-nearest": "#E69F00",
    "task-posture": "#D55E00",
    "task-mean": "#F0E442",
    "task-grasp": "#999999",
}


def label_of(decoder: str, *, broken: bool = False) -> str:
    """A decoder's name for people, in one line unless it may be ``broken``."""
    text = _LABELS.get(decoder, decoder)
    return text if broken else text.replace("\n", " ")


def success_table(cells: Sequence[Mapping[str, Any]]) -> str:
    """Render results of rollouts or replays as a Markdown table."""
    timed, replayed = "decode_p50_ms" in cells[0], "leader" in cells[0]
    headings = ["Task", *["Leader"] * replayed, "Decoder", "Success", "95 % interval", "Failures", "Invalid actions"]
    headings += ["Decode p50 / p99"] * timed + ["Joints off the demo by"] * replayed + ["Largest step"]
    rows = []
    for cell in cells:
        low, high = cell["interval"]
        row = [cell["task"]]
        if replayed:
            starts, dropped = cell["leader"]["starts"], cell["leader"]["dropped"]
            row.append(", ".join(filter(None, [f"{starts - sum(dropped.values())}/{starts}", tally(dropped)])))
        row += [
            cell["decoder"],
            f"**{cell['successes']}/{cell['episodes']}**",
            f"{low:.1%} – {high:.1%}",
            tally(cell["failures"]) or "–",
            f"{cell['invalid_rate']:.1%}",
        ]
        if timed:
            row.append(f"{cell['decode_p50_ms']:.2f} / {cell['decode_p99_ms']:.2f} ms")
        if replayed:
            row.append(f"{cell['max_joint_deviation']:.3f} rad")
        rows.append([*row, f"{cell['max_joint_step']:.3f} rad"])
    return markdown_table(headings, rows)


def write_chart(cells: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write a bar chart of success with exact 95 % intervals, one group of bars a task."""
    tasks = list(dict.fromkeys(cell["task"] for cell in cells))
    decoders = list(dict.fromkeys(cell["decoder"] for cell in cells))
    figure = Figure(figsize=(1.6 + 1.15 * len(cells), 3.8), dpi=140, layout="constrained")
    axis = figure.subplots()
    ticks = []
    for cell in cells:
        x = tasks.index(cell["task"]) * (len(decoders) + 0.8) + decoders.index(cell["decoder"])
        share, (low, high) = cell["successes"] / cell["episodes"], cell["interval"]
        axis.bar(x, 100 * share, width=0.72, color=COLOURS.get(cell["decoder"], "#999999"), zorder=2)
        spread = 100 * np.array([[share - low], [high - share]])
        axis.errorbar(x, 100 * share, yerr=spread, color="#222222", capsize=5, linewidth=1.3, zorder=3)
        axis.text(x, 106, f"{cell['successes']}/{cell['episodes']}", ha="center", fontsize=9, color="#222222")
        ticks.append((x, label_of(cell["decoder"], broken=True)))
    axis.set_xticks([x for x, _ in ticks], [label for _, label in ticks], fontsize=9)
    axis.set_ylim(0, 114)
    axis.set_yticks(range(0, 101, 25))
    axis.set_ylabel("Successful rollouts [%]")
    axis.grid(axis="y", color="#dddddd", zorder=0)
    axis.spines[["top", "right"]].set_visible(False)
    axis.set_title(", ".join(tasks) + "   (bars: exact 95 % intervals)", fontsize=10, loc="left")
    figure.savefig(path)


def write_page(folder: Path, title: str, introduction: str, pictures: Mapping[str, str]) -> None:
    """Write ``report.md`` from ``report.json`` in a folder, with the chart and named pictures.

    Args:
        folder: Where ``report.json`` is and the page goes.
        title: Heading of the page.
        introduction: What was done, in a paragraph.
        pictures: Caption to file name, relative to the folder; films become links.
    """
    report = json.loads((folder / REPORT).read_text())
    cells, meta = report["cells"], report["meta"]
    write_chart(cells, folder / CHART)
    shown = [f"![{caption}]({name})\n\n*{caption}*" for caption, name in pictures.items() if name.endswith(PICTURES)]
    links = [f"- [{caption}]({name})" for caption, name in pictures.items() if not name.endswith(PICTURES)]
    versions = ", ".join(f"{name} {version}" for name, version in meta["versions"].items())
    settings = [
        f"- {key.replace('_', ' ')}: {value}"
        for key, value in meta.items()
        if key not in ("git", "versions", "machine")
    ]
    page = [
        f"# {title}",
        introduction,
        success_table(cells),
        f"![Success of each decoder]({CHART})",
        *shown,
        "\n".join(links),
        "## How it was made",
        "\n".join(
            [
                f"- code: {meta['git'] or 'no checkout'}",
                f"- versions: {versions}",
                f"- machine: {meta['machine']['processor']}, {meta['machine']['cores']} cores",
                *settings,
            ]
        ),
    ]
    (folder / PAGE).write_text("\n\n".join(page) + "\n")
