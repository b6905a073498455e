"""A benchmark's page: tables, figure, pictures, and what they do and do not say; rendered from its report alone."""

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

from er_il.evaluation.results import EPISODES, REFERENCE, RESULTS
from er_il.report import paper
from er_il.report.benchmark_figure import write_bars, write_curves
from er_il.report.benchmark_table import compact_table, difference, full_table

TABLE, PAGE = "table.md", "README.md"
BARS, CURVES = "table.png", "curves.png"
STRIPS = "strip_*.png"  # one a task

RULES = {
    "task-nearest": "the solution nearest to the present joints",
    "task-posture": "pulled to a comfortable posture",
}
MARGIN = 0.05  # a decoder does as well as the reference if its paired difference is, at 95 %, above minus this

Report = Mapping[str, Any]


def write_pages(folder: Path) -> None:
    """Write the figure, the table and the page of a folder from its ``results.json``."""
    report = json.loads((folder / RESULTS).read_text())
    if not report["cells"]:
        return
    if _varied(report):
        figure = CURVES
        write_curves(report["cells"], folder / figure)
    else:
        figure = BARS
        write_bars(report["cells"], folder / figure, compared=_compared(report))
    (folder / TABLE).write_text(full_table(report) + "\n")
    strips = sorted(path.name for path in folder.glob(STRIPS))
    (folder / PAGE).write_text("\n\n".join(_page(report, figure, strips)) + "\n")


def _page(report: Report, figure: str, strips: list[str]) -> list[str]:
    meta = report["meta"]
    page = [f"# {meta['title']}", meta["grid"]["introduction"], _counts(report), compact_table(report)]
    page.append(f"![Success of each decoder]({figure})")
    if missing := [f"{each['task']} {each['decoder']}" for each in meta["missing"]]:
        page.append(f"Not complete: {', '.join(missing)}.")
    if _compared(report):
        page += ["## What differs from the paper", _differences(report)]
    if _baselines(report):
        page += ["## Would a fixed posture do?", _postures(report)]
    if strips:
        page += ["## The same start through each decoder", *(f"![{name[:-4]}]({name})" for name in strips)]
    page += ["## Every cell", full_table(report), _legend(report), "## How it was made", _origin(report)]
    return [paragraph for paragraph in page if paragraph]


def _varied(report: Report) -> bool:
    """Whether the number of demonstrations varies."""
    return len(report["meta"]["grid"]["demonstrations"]) > 1


def _compared(report: Report) -> bool:
    """Whether the paper did the like: any of the tasks, with a Panda's seven joints."""
    grid = report["meta"]["grid"]
    return grid["arm"] == paper.ARM and any(task in paper.SUCCESSES for task in grid["tasks"])


def _counts(report: Report) -> str:
    grid = report["meta"]["grid"]
    seeds = len(grid["training_seeds"])
    return (
        f"Successes of {grid['rollouts']} rollouts of each of {seeds} "
        f"{'policy' if seeds == 1 else 'policies (training seeds)'}, with exact 95 % intervals. Decoders that read the "
        "same action space share the policies; every decoder meets the same initial states, none of which was "
        "demonstrated. The numbers of seeds and rollouts were fixed beforehand, and the last checkpoint counts. An "
        "interval takes rollouts as independent, though those of one training seed share a policy: compare the seeds."
    )


def _differences(report: Report) -> str:
    meta, grid = report["meta"], report["meta"]["grid"]
    episodes = report["cells"][0]["episodes"]
    steps = sorted(set(meta["training_steps"].values()))
    marked = not _varied(report) and any(
        paper.share(*each) is not None for each in product(grid["tasks"], grid["decoders"])
    )
    own = [task for task in grid["tasks"] if task not in paper.SUCCESSES]
    lines = [
        "Simulation: a Panda in MuJoCo, led by a scripted arm; the paper has two real ones, and a person who leads.",
        f"{_sight(grid)} They are small, trained for {' to '.join(map(str, steps))} steps on a CPU.",
        f"{episodes} rollouts a cell instead of {paper.ROLLOUTS}"
        + ("; the diamonds are the paper's figures." if marked else "."),
    ]
    if rules := [f"`{name}`: {rule}" for name, rule in RULES.items() if name in grid["decoders"]]:
        lines.append(
            f"Task space is decoded by {'one rule' if len(rules) == 1 else 'each of two rules'} ({'; '.join(rules)}), "
            f"where the paper uses one solver, pick_ik.{' Its diamond stands beside `task-nearest`.' if marked else ''}"
        )
    lines.append("Furniture, objects and their places follow the paper's description and pictures, not its measures.")
    if "era" in grid["decoders"]:
        lines.append("ERA is in the table; the paper's real robot had joint, task and ERJ.")
    if own:
        lines.append(f"{', '.join(f'`{task}`' for task in own)}: not in the paper.")
    return "\n".join(f"- {line}" for line in lines)


def _sight(grid: Mapping[str, Any]) -> str:
    """What the policies see."""
    if not grid["cameras"]:
        return "The policies see the true poses of the objects (state-based), where the paper's see camera images."
    each = ", ".join(f"`{task}` {' and '.join(names)}" for task, names in grid["cameras"].items())
    return (
        f"The policies see the arm's state and images (`configs/act_<space>_{grid['configuration']}.yaml`; cameras: "
        f"{each}), smaller ones than the paper's 224 × 224."
    )


def _baselines(report: Report) -> list[str]:
    """The posture baselines of a grid, which version 0.1.0 called sceptics."""
    grid = report["meta"]["grid"]
    return grid["posture_baselines" if "posture_baselines" in grid else "sceptics"]


def _postures(report: Report) -> str:
    names = _baselines(report)
    enough, not_enough = [], []
    for task in report["meta"]["grid"]["tasks"]:
        cells = [cell for cell in report["cells"] if cell["task"] == task and cell["decoder"] in names]
        paired = {cell["decoder"]: cell[f"difference_to_{REFERENCE}"] for cell in cells if difference(cell)}
        good = [f"`{name}`" for name, each in paired.items() if each["interval"][0] > -MARGIN]
        if good:
            enough.append(f"`{task}` ({', '.join(good)})")
        elif paired:
            not_enough.append(f"`{task}`")
    return "\n\n".join(
        [
            "Task space with its null space pulled to one posture of the demonstrations: their mean joint angles "
            "(`task-mean`), or those at the grasp or the press (`task-grasp`). The same policies, those of the first "
            "training seed.",
            compact_table(report, (REFERENCE, *names)),
            f"- That is enough on: {', '.join(enough) or 'none of the tasks'}.\n"
            f"- It is not enough on: {', '.join(not_enough) or 'none of the tasks'}.",
            f"Enough: the paired difference to {REFERENCE} is above −{100 * MARGIN:.0f} points at 95 %.",
        ]
    )


def _legend(report: Report) -> str:
    elbow = (
        " *Elbow off by*: mean distance of the elbow from where the demonstrations that were trained on had it, with "
        "the hand at the nearest place and time."
    )
    return (
        f"*Minus {REFERENCE}, paired*: percentage points over the same initial states and training seeds, with a 95 % "
        "interval (Bonett and Price). *Invalid actions*: the decoder could not do exactly what the action said. "
        "*Largest step*: the largest change of a joint that an action asked for."
        + elbow * any("elbow_error" in cell for cell in report["cells"])
        + f" Every rollout is a row of [`{EPISODES}`]({EPISODES})."
    )


def _origin(report: Report) -> str:
    meta = report["meta"]
    costs = meta["costs"]
    versions = ", ".join(f"{name} {version}" for name, version in meta["versions"].items())
    demonstrations = ", ".join(map(str, meta["grid"]["demonstrations"]))
    return "\n".join(
        [
            f"- code: {', '.join(meta['computed_by'])}",
            f"- versions: {versions}",
            f"- machine: {meta['machine']['processor']}, {meta['machine']['cores']} cores",
            f"- mixed precision of the trainings: {', '.join(meta['mixed_precision'])}",
            f"- trained on {demonstrations} demonstrations (recipe seed 0; normalised with the statistics of all that "
            "were recorded)",
            f"- training seeds: {', '.join(map(str, meta['grid']['training_seeds']))}; "
            f"rollout seeds: {meta['rollout_seeds']}",
            f"- cost: {costs['trainings']} trainings in {costs['training_cpu_s'] / 3600:.1f} h, {costs['rollouts']} "
            f"rollouts in {costs['rollout_cpu_s'] / 3600:.1f} h of one core",
        ]
    )
