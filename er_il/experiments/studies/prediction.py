"""How well the adviser's ranking of ERJ's joints predicts the success of policies trained with them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from er_il.report.tables import joined
from er_il.spaces.registry import split_name
from er_il.support.errors import DatasetError

KEYS = ("task", "decoder", "successes", "episodes", "interval")


def read_training(path: Path) -> list[dict[str, Any]]:
    """Read the cells of a report of rollouts whose decoders are ``erj`` or ``erj@<joint>``.

    Raises:
        DatasetError: the file is no such report.
    """
    try:
        cells = [{key: cell[key] for key in KEYS} for cell in json.loads(path.read_text())["cells"]]
    except FileNotFoundError as error:
        raise DatasetError(f"There is no {path}: er-il benchmark writes it.") from error
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise DatasetError(f"{path} is no report of rollouts: its cells need {', '.join(KEYS)}.") from error
    return [cell for cell in cells if cell["decoder"].partition("@")[0] == "erj"]


def predict(report: Mapping[str, Any], cells: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Compare a study's ranking with success after training, task by task.

    A choice's predicted risk on a task is that along its demonstrations if the study had them, else
    over the workspace.

    Args:
        report: See :func:`er_il.experiments.studies.joints.study_joints`.
        cells: See :func:`read_training`.

    Returns:
        For each task: risk and success of each choice, Spearman's correlation of success with low
        risk (None where all succeed alike), and whether the choice with the least risk is the best
        trained, by number or within the best one's interval.
    """
    found = []
    for task in dict.fromkeys(cell["task"] for cell in cells):
        risks = _risks(report, task)
        trained = {_choice(cell["decoder"], report): cell for cell in cells if cell["task"] == task}
        rows = [
            {"joints": name, "risk": risks[name], "success": cell["successes"] / cell["episodes"]}
            | {key: cell[key] for key in KEYS if key != "task"}
            for name, cell in trained.items()
            if name in risks
        ]
        if len(rows) < 2:
            continue
        top, best = min(rows, key=lambda row: row["risk"]), max(rows, key=lambda row: row["success"])
        found.append(
            {
                "task": task,
                "choices": rows,
                "rank_correlation": _correlation(rows),
                "top_choice": top["joints"],
                "top_choice_is_best": top["success"] == best["success"],
                "top_choice_within_interval_of_best": top["success"] >= best["interval"][0],
            }
        )
    return found


def _risks(report: Mapping[str, Any], task: str) -> dict[str, float]:
    return {joined(each["joints"]): each["risk"] for each in report["demos"].get(task, report["workspace"])}


def _choice(decoder: str, report: Mapping[str, Any]) -> str:
    return joined(split_name(decoder)[1] or report["default"])


def _correlation(rows: Sequence[Mapping[str, Any]]) -> float | None:
    risks, successes = [row["risk"] for row in rows], [row["success"] for row in rows]
    if len(set(risks)) == 1 or len(set(successes)) == 1:
        return None
    return float(np.asarray(spearmanr(-np.array(risks), successes))[0])
