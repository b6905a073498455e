"""What came out of a benchmark, as data: a report as JSON, and every rollout as a row of a compressed CSV."""

import csv
import gzip
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from er_il.evaluation.results import EPISODES, REFERENCE, RESULTS, load_notes
from er_il.evaluation.rollouts import FIRST_SEED, Cell
from er_il.evaluation.statistics import exact_interval, paired_difference
from er_il.experiments.grid import Entry
from er_il.experiments.plan import Plan
from er_il.support.atomic_files import write_atomically, write_json
from er_il.support.provenance import provenance

BySeed = Mapping[int, Cell]  # the rollouts of an entry by training seed


def write_results(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write ``results.json`` and ``episodes.csv.gz`` of all complete cells; return the former."""
    cells, rows = [], []
    references: dict[tuple[str, int], BySeed | None] = {}
    for entry in plan.grid.entries:
        key = entry.task, entry.demonstrations
        if key not in references:
            reference = Entry(entry.task, REFERENCE, entry.demonstrations)
            references = {key: plan.results(reference) if reference in plan.targets else None}  # one task at a time
        by_seed = plan.results(entry)
        if by_seed is not None:
            cells.append(cell_report(entry, by_seed, references[key]))
            rows += _rows(entry, by_seed)
    report = {"meta": provenance() | _meta(plan, cells), "cells": cells}
    write_json(folder / RESULTS, report)
    write_atomically(folder / EPISODES, lambda path: path.write_bytes(_compressed(rows)))
    return report


def cell_report(entry: Entry, by_seed: BySeed, reference: BySeed | None) -> dict[str, Any]:
    """Return a cell as JSON: the rollouts of all training seeds together, then seed by seed.

    Args:
        entry: Which cell.
        by_seed: Its rollouts.
        reference: The rollouts of :data:`REFERENCE` on the same task from the same initial states, if there are any.
    """
    episodes = tuple(episode for cell in by_seed.values() for episode in cell.episodes)
    report = Cell(entry.task, entry.decoder, episodes).report() | {"demonstrations": entry.demonstrations}
    report["per_seed"] = [
        {
            "training_seed": seed,
            "successes": cell.successes,
            "episodes": len(cell.episodes),
            "interval": list(exact_interval(cell.successes, len(cell.episodes))),
        }
        for seed, cell in by_seed.items()
    ]
    if reference is not None and entry.decoder != REFERENCE:
        theirs = [episode.success for seed in by_seed for episode in reference[seed].episodes]
        difference, low, high = paired_difference([episode.success for episode in episodes], theirs)
        report[f"difference_to_{REFERENCE}"] = {"difference": difference, "interval": [low, high]}
    return report


def _meta(plan: Plan, cells: list[dict[str, Any]]) -> dict[str, Any]:
    grid = plan.grid
    trainings = {plan.training(entry, seed) for entry in grid.entries for seed in grid.training_seeds}
    trained = [training.read_notes() for training in trainings if training.done]
    rolled_out = [load_notes(job.path) for job in plan.jobs if job.done]
    complete = {(cell["task"], cell["decoder"], cell["demonstrations"]) for cell in cells}
    missing = [vars(entry) for entry in grid.entries if tuple(vars(entry).values()) not in complete]
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
        "missing": missing,
    }


def _rows(entry: Entry, by_seed: BySeed) -> Iterator[list[object]]:
    for seed, cell in by_seed.items():
        for e in cell.episodes:
            elbow = "" if e.elbow_error is None else f"{e.elbow_error:.6f}"
            counts = [int(e.success), e.failure, e.steps, e.invalid, f"{e.joint_step:.6f}", elbow]
            yield [entry.task, entry.decoder, entry.demonstrations, seed, e.seed, *counts]


COLUMNS = "task,decoder,demonstrations,training_seed,seed,success,failure,steps,invalid,max_joint_step,elbow_error"


def _compressed(rows: list[list[object]]) -> bytes:
    """Rows as CSV in gzip, the same bytes for the same rows: neither names nor times go into the header."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS.split(","))
    writer.writerows(rows)
    return gzip.compress(text.getvalue().encode(), mtime=0)
