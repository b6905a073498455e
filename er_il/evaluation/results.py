"""Results on disk: a report as JSON and one row an episode as CSV, never half-written."""

import csv
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from er_il.evaluation.rollouts import Cell, Episode
from er_il.support.atomic_files import write_atomically, write_json

REFERENCE = "joint"  # the decoder that the others are compared with, rollout by rollout
RESULTS = "results.json"  # the report of a grid, from which everything is rendered
EPISODES = "episodes.csv.gz"


def write_cells(cells: Sequence[Cell], meta: dict[str, Any], folder: Path) -> None:
    """Write ``report.json`` and one row an episode in ``episodes.csv``."""
    write_json(folder / "report.json", {"meta": meta, "cells": [cell.report() for cell in cells]})
    write_atomically(folder / "episodes.csv", lambda path: _write_csv(cells, path))


def save_cell(cell: Cell, path: Path, notes: Mapping[str, Any] | None = None) -> None:
    """Write a cell with all its episodes, for :func:`load_cell`, and notes (JSON) on how it came about."""
    data = vars(cell) | {"episodes": [vars(episode) for episode in cell.episodes], "notes": notes or {}}
    write_atomically(path, lambda partial: partial.write_text(json.dumps(data)))


def load_notes(path: Path) -> dict[str, Any]:
    """Read the notes of a cell that :func:`save_cell` wrote."""
    return json.loads(path.read_text())["notes"]


def load_cell(path: Path) -> Cell:
    """Read what :func:`save_cell` wrote."""
    data = json.loads(path.read_text())
    episodes = [
        Episode(**episode | {"statuses": Counter(episode["statuses"]), "latencies": tuple(episode["latencies"])})
        for episode in data["episodes"]
    ]
    return Cell(data["task"], data["decoder"], tuple(episodes))


def _write_csv(cells: Sequence[Cell], path: Path) -> None:
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["task", "decoder", "seed", "success", "failure", "steps", "invalid", "max_joint_step"])
        for cell in cells:
            for e in cell.episodes:
                rows.writerow(
                    [
                        cell.task,
                        cell.decoder,
                        e.seed,
                        int(e.success),
                        e.failure,
                        e.steps,
                        e.invalid,
                        f"{e.joint_step:.6f}",
                    ]
                )
