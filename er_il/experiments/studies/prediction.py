"""How well the adviser's ranking of ERJ's joints predicts the success of policies trained with them."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, StrictInt, StrictStr

from er_il.spaces.registry import split_name
from er_il.support.declaration import check_values
from er_il.support.errors import DatasetError
from er_il.support.json_files import read_json

KEYS = ("task", "decoder", "successes", "episodes", "interval")


class _Cell(BaseModel):
    task: StrictStr
    decoder: StrictStr
    successes: Annotated[StrictInt, Field(ge=0)]
    episodes: Annotated[StrictInt, Field(ge=1)]
    interval: tuple[float, float]


class _Report(BaseModel):
    """What is needed of a report of rollouts."""

    cells: list[_Cell]


def read_training(path: Path) -> list[dict[str, Any]]:
    """Read the cells of a report of rollouts whose decoders are ``erj`` or ``erj@<joint>``.

    Raises:
        DatasetError: the file is no such report.
    """
    if not path.exists():
        raise DatasetError(f"There is no {path}: er-il benchmark writes it.")
    report = read_json(path, DatasetError)
    check_values(_Report, report, path, DatasetError)
    cells = [{key: cell[key] for key in KEYS} for cell in report["cells"]]
    return [cell for cell in cells if cell["decoder"].partition("@")[0] == "erj"]


def predict(report: Mapping[str, Any], cells: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Compare a study's ranking with success after training, task by task.

    A choice's predicted risk on a task is that along its demonstrations if the study had them, else over the workspace.

    Args:
        report: See :func:`er_il.experiments.studies.joints.study_joints`.
        cells: See :func:`read_training`.

    Returns:
        For each task: risk and success of each choice, Spearman's correlation of success with low risk (None where all
        succeed alike), and whether the choice with the least risk is the best trained, by number or within the best
        one's interval.
    """
    import numpy as np
    import pandas as pd
    from scipy.stats import spearmanr

    from er_il.report.tables import joined

    data = pd.DataFrame(cells, columns=pd.Index(KEYS))
    data["joints"] = [joined(split_name(decoder)[1] or report["default"]) for decoder in data["decoder"]]
    data["success"] = data["successes"] / data["episodes"]
    found = []
    for task, trained in data.groupby("task", sort=False):
        risks = {joined(each["joints"]): each["risk"] for each in report["demos"].get(task, report["workspace"])}
        rows = trained.drop(columns="task").assign(risk=[risks.get(choice) for choice in trained["joints"]])  # pyrefly: ignore[bad-argument-type]
        rows = rows.dropna(subset="risk").drop_duplicates("joints", keep="last")
        if len(rows) < 2:
            continue
        top, best = rows.loc[rows["risk"].idxmin()], rows.loc[rows["success"].idxmax()]
        alike = 1 in (rows["risk"].nunique(), rows["success"].nunique())
        correlation = None if alike else float(np.asarray(spearmanr(-rows["risk"], rows["success"]))[0])
        found.append(
            {
                "task": task,
                "choices": rows.to_dict("records"),
                "rank_correlation": correlation,
                "top_choice": top["joints"],
                "top_choice_is_best": bool(top["success"] == best["success"]),
                "top_choice_within_interval_of_best": bool(top["success"] >= best["interval"][0]),
            }
        )
    return found
