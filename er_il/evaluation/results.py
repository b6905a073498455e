"""Results of rollouts: one by one, in long form with one row a rollout, and what reports say of them."""

import json
from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from er_il.evaluation.rollout import Rollout
from er_il.evaluation.statistics import exact_interval, paired_difference
from er_il.kinematics.solver import Status
from er_il.support.atomic_files import write_atomically
from er_il.support.errors import ErIlError
from er_il.support.json_files import read_json

REFERENCE = "joint"  # the decoder that the others are compared with, rollout by rollout
RESULTS = "results.json"  # the report of a grid, from which everything is rendered
EPISODES = "episodes.csv.gz"

CELL = ["task", "decoder", "demonstrations"]
WITHIN = "within"  # one more of a cell, in grids that vary where initial states are drawn
KINDS = {"demonstrations": int, WITHIN: float}  # of the values that tell cells apart, beside names
LABELS = [*CELL, "training_seed"]
COUNTS = ["seed", "success", "failure", "steps", "invalid", "max_joint_step"]
COLUMNS = [*LABELS, *COUNTS, "elbow_error"]  # of a CSV; in memory there are statuses and latencies, too


def save_rollouts(rollouts: Sequence[Rollout], path: Path, notes: Mapping[str, Any]) -> None:
    """Write rollouts, for :func:`load_rollouts`, and notes (JSON) on how they came about."""
    data = {"episodes": [vars(rollout) for rollout in rollouts], "notes": notes}
    write_atomically(path, lambda partial: partial.write_text(json.dumps(data)))


def load_rollouts(path: Path) -> list[Rollout]:
    """Read what :func:`save_rollouts` wrote.

    Raises:
        ErIlError: the file is missing or damaged.
    """
    try:
        return [
            Rollout(**each | {"statuses": Counter(each["statuses"]), "latencies": tuple(each["latencies"])})
            for each in read_json(path, ErIlError)["episodes"]
        ]
    except (KeyError, TypeError) as error:
        raise ErIlError(
            f"{path} is damaged: it holds no rollouts. Delete it, and the same command makes it again."
        ) from error


def load_notes(path: Path) -> dict[str, Any]:
    """Read the notes that :func:`save_rollouts` wrote."""
    notes = read_json(path, ErIlError).get("notes")
    if not isinstance(notes, dict):
        raise ErIlError(f"{path} is damaged: it holds no notes. Delete it, and the same command makes it again.")
    return notes


def long_form(groups: Iterable[tuple[Mapping[str, object], Iterable[Rollout]]]) -> pd.DataFrame:
    """Return one row a rollout: :data:`COLUMNS`, :data:`WITHIN` if it is among the labels, ``statuses``, ``latencies``.

    Args:
        groups: Values of :data:`LABELS`, and of :data:`WITHIN` if it varies, and the rollouts that they hold for.
    """
    rows = [
        {**labels, **vars(each), "steps": each.steps, "invalid": each.invalid, "max_joint_step": each.joint_step}
        for labels, rollouts in groups
        for each in rollouts
    ]
    varied = [WITHIN] if any(WITHIN in row for row in rows) else []
    columns = pd.Index([*varied, *COLUMNS, "statuses", "latencies"])
    return pd.DataFrame(rows, columns=columns).astype({"elbow_error": float})


def as_csv(rollouts: pd.DataFrame, columns: Sequence[str] = ()) -> str:
    """Return the rollouts as CSV, a row each, with these columns or all that :func:`long_form` says of a rollout."""
    shown = rollouts.astype({"success": int})
    columns = columns or [name for name in (WITHIN, *COLUMNS) if name in rollouts]
    return shown.to_csv(columns=list(columns), index=False, float_format="%.6f", lineterminator="\n")


def summarise(rollouts: pd.DataFrame) -> dict[str, Any]:
    """Return what a report says of rollouts, or replays, of one task through one decoder, as JSON.

    Args:
        rollouts: Columns ``success``, ``failure``, ``statuses`` and ``max_joint_step``; of rollouts also
            ``latencies``, ``steps`` and ``elbow_error``.
    """
    count, successes = len(rollouts), int(rollouts["success"].sum())
    statuses = sum(rollouts["statuses"], Counter[str]())
    report = {
        "successes": successes,
        "episodes": count,
        "interval": list(exact_interval(successes, count)),
        "failures": dict(Counter(rollouts.loc[~rollouts["success"], "failure"]).most_common()),
        "statuses": dict(statuses.most_common()),
        "invalid_rate": 1 - statuses[Status.OK] / statuses.total(),
        "max_joint_step": float(rollouts["max_joint_step"].max()),
    }
    if "latencies" in rollouts:
        p50, p99 = 1e3 * np.percentile(np.concatenate(list(rollouts["latencies"])), [50, 99])
        report |= {"decode_p50_ms": float(p50), "decode_p99_ms": float(p99)}
        report["mean_steps"] = float(rollouts["steps"].mean())
        if measured := rollouts["elbow_error"].dropna().tolist():
            report["elbow_error"] = float(np.mean(measured))
    return report


def report_cells(rollouts: pd.DataFrame, cell_of: Sequence[str] = ()) -> list[dict[str, Any]]:
    """Return each cell as JSON: the rollouts of all training seeds together, then seed by seed.

    Where :data:`REFERENCE` met the same initial states with policies of the same training seeds, the paired
    difference to it stands beside.

    Args:
        rollouts: In long form.
        cell_of: The columns of a cell: ``task``, ``decoder``, and what else tells cells apart; those of
            :data:`CELL`, and :data:`WITHIN` where it is, if empty.
    """
    cell_of = cell_of or [name for name in (*CELL, WITHIN) if name in rollouts]
    cells = []
    for key, cell in rollouts.groupby(list(cell_of), sort=False):
        labels = dict(zip(cell_of, _labels(key), strict=True))
        others = {name: KINDS[name](value) for name, value in labels.items() if name in KINDS}
        report = {"task": labels["task"], "decoder": labels["decoder"]} | summarise(cell) | others
        per_seed = {seed: summarise(part) for seed, part in cell.groupby("training_seed", sort=False)}
        report["per_seed"] = [
            {"training_seed": int(str(seed))} | {name: each[name] for name in ("successes", "episodes", "interval")}
            for seed, each in per_seed.items()
        ]
        cells.append(report | difference_to_reference(cell, cell_of, rollouts))
    return cells


def difference_to_reference(cell: pd.DataFrame, cell_of: Sequence[str], among: pd.DataFrame) -> dict[str, Any]:
    """Return the paired difference of a cell to :data:`REFERENCE` by its key in reports; nothing where none is there.

    Args:
        cell: Rollouts of one cell.
        cell_of: The columns that tell cells apart.
        among: Rollouts with those of the reference.
    """
    matched = [*(column for column in cell_of if column != "decoder"), "training_seed", "seed"]
    reference = among.loc[among["decoder"] == REFERENCE, [*matched, "success"]]
    paired = cell.merge(reference, on=matched, suffixes=("", "_theirs"))
    if (cell["decoder"] == REFERENCE).all() or not len(paired):
        return {}
    difference, low, high = paired_difference(paired["success"].tolist(), paired["success_theirs"].tolist())
    return {f"difference_to_{REFERENCE}": {"difference": difference, "interval": [low, high]}}


def _labels(key: Hashable) -> tuple[Any, ...]:
    assert isinstance(key, tuple)
    return key
