"""What a study of invalid actions found: every cell, the sizes taken together, and how that compares with the paper."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from er_il.evaluation.statistics import exact_interval
from er_il.experiments.studies.validity import DEMOS, PERIOD, RANDOM, SIZES, SPACES, TURN, Cell, Outcome

Row = Mapping[str, Any]

PAPER_MS = {"task": 12.0, "erj": 19.0, "era": 13.0}  # computation and execution times that the paper reports


def report(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Everything as JSON."""
    keys = dict.fromkeys(replace(outcome.cell, size=0.0) for outcome in outcomes)
    pooled = [_pooled(key, [each for each in outcomes if replace(each.cell, size=0.0) == key]).report() for key in keys]
    for row in pooled:
        del row["size"]
    return {
        "sizes_m": list(SIZES),
        "turn_rad_per_m": TURN,
        "period_s": PERIOD,
        "paper_ms": PAPER_MS,
        "pooled": pooled,
        "findings": [*_most_invalid(pooled), _damping(pooled), _latency(pooled)],
        "cells": [outcome.report() for outcome in outcomes],
    }


def shares(pooled: Sequence[Row], around: str, damped: bool) -> dict[str, tuple[float, float, float]]:
    """Invalid share of each space and its exact 95 % interval, all modes and sizes together."""
    found = {}
    for space in SPACES:
        rows = [row for row in pooled if (row["space"], row["around"], row["damped"]) == (space, around, damped)]
        invalid, actions = sum(row["invalid"] for row in rows), sum(row["actions"] for row in rows)
        found[space] = (invalid / actions, *exact_interval(invalid, actions))
    return found


def _most_invalid(pooled: Sequence[Row]) -> list[str]:
    said = []
    for around, where in ((DEMOS, "demonstrations"), (RANDOM, "random states")):
        found = shares(pooled, around, damped=True)
        first, second, *_ = sorted(found, key=lambda space: -found[space][0])
        clear = found[second][2] < found[first][1]
        listed = ", ".join(f"{space.upper()} {share:.0%}" for space, (share, _, _) in found.items())
        most = f"{first.upper()} has" if clear else f"{first.upper()} and {second.upper()} have"
        paper = " As in the paper." if clear and first == "era" else " In the paper ERA has."
        said.append(f"Around {where} {most} most invalid actions: {listed}.{paper}")
    return said


def _damping(pooled: Sequence[Row]) -> str:
    damped, undamped = ({around: shares(pooled, around, each) for around in (DEMOS, RANDOM)} for each in (True, False))
    largest = max(abs(undamped[around][space][0] - damped[around][space][0]) for around in damped for space in SPACES)
    slowest = [max(row["iterations_p99"] for row in pooled if row["damped"] is each) for each in (True, False)]
    return (
        f"Without damping the shares change by {largest:.1%} at most, and the slowest decodes (p99) take "
        f"{slowest[1]:.0f} iterations instead of {slowest[0]:.0f}."
    )


def _latency(pooled: Sequence[Row]) -> str:
    listed = []
    for space in SPACES:
        rows = [row for row in pooled if row["space"] == space and row["damped"]]
        p50, p99 = (max(row[key] for row in rows) for key in ("decode_p50_ms", "decode_p99_ms"))
        listed.append(f"{space.upper()} {p50:.1f} and {p99:.1f} ms (paper {PAPER_MS[space]:.0f} ms)")
    return f"Decoding takes at most, median and p99: {', '.join(listed)}; the paper's times include execution."


def _pooled(key: Cell, outcomes: Sequence[Outcome]) -> Outcome:
    return Outcome(
        key,
        sum((outcome.statuses for outcome in outcomes), Counter[str]()),
        tuple(count for outcome in outcomes for count in outcome.iterations),
        tuple(latency for outcome in outcomes for latency in outcome.latencies),
    )
