"""The results of an experiment on disk: a report as JSON, and every rollout as a row of a compressed CSV."""

import gzip
from pathlib import Path
from typing import Any

from er_il.evaluation.results import EPISODES, RESULTS, as_csv, load_notes, report_cells
from er_il.evaluation.rollouts import FIRST_SEED
from er_il.experiments.plan import Plan
from er_il.support.atomic_files import write_atomically, write_json
from er_il.support.provenance import provenance


def write_results(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write ``results.json`` and ``episodes.csv.gz`` of all complete cells; return the former."""
    rollouts = plan.rollouts(*plan.complete)
    report = {"meta": provenance() | _meta(plan), "cells": report_cells(rollouts)}
    write_json(folder / RESULTS, report)
    # The same bytes for the same rollouts: neither a name nor a time goes into the header.
    compressed = gzip.compress(as_csv(rollouts).encode(), mtime=0)
    write_atomically(folder / EPISODES, lambda path: path.write_bytes(compressed))
    return report


def _meta(plan: Plan) -> dict[str, Any]:
    grid = plan.grid
    trainings = {plan.training(cell, seed) for cell in grid.cells for seed in grid.training_seeds}
    trained = [training.read_notes() for training in trainings if training.done]
    rolled_out = [load_notes(job.path) for job in plan.jobs if job.done]
    complete = plan.complete
    return {
        "title": grid.title,
        "grid": grid.to_dict(),
        "computed_by": sorted({notes["git"] for notes in (*trained, *rolled_out)}),
        "training_steps": {training.space: training.steps for training in sorted(trainings, key=lambda t: t.space)},
        "mixed_precision": sorted({notes["mixed_precision"] for notes in trained}),
        "rollout_seeds": f"{FIRST_SEED} to {FIRST_SEED + grid.rollouts - 1}",
        "costs": {
            "trainings": len(trained),
            "training_cpu_s": round(sum(notes["cost"]["cpu"] for notes in trained)),
            "rollouts": sum(job.count for job in plan.jobs if job.done),
            "rollout_cpu_s": round(sum(notes["cost"]["cpu"] for notes in rolled_out)),
        },
        "missing": [vars(cell) for cell in grid.cells if cell not in complete],
    }
