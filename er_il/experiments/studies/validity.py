"""The paper's study of invalid actions: their share in each space, their causes, and the cost of decoding them.

Actions are drawn around states of demonstrations and around random configurations:

- delta, as a policy that knows nothing yet (the paper's RL): every change uniform within plus and minus the size;
- absolute, as a policy that has learnt the state: every number off by a normal error of the size.

A size is in metres; rotations and angles go with it by ``TURN`` rad a metre. All spaces get the same states, the same
errors of the pose and, where they have one, of the redundancy value. An action is invalid if the arm could not follow
it: :class:`er_il.kinematics.solver.Status` says why.
"""

import itertools
import time
from collections import Counter
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from er_il.arms.arm import Arm
from er_il.control.commander import Commander
from er_il.evaluation.statistics import exact_interval
from er_il.experiments.studies import Advance, Demos
from er_il.kinematics.solver import Status
from er_il.report.validity import SPACES, findings
from er_il.spaces.base import Array
from er_il.spaces.delta import DeltaBounds, DeltaSpace
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space
from er_il.support.workers import run_jobs

SIZES = (0.01, 0.02, 0.05, 0.1, 0.2)  # [m]
TURN = 3.0  # [rad/m] the ratio of a delta space's declared bounds
# Of each number of an action, times the size. A quaternion's numbers change by half the angle.
SCALES = {"delta": np.array([1.0] * 3 + [TURN] * 4), "absolute": np.array([1.0] * 3 + [TURN / 2] * 4 + [TURN])}
PERIOD = 0.05  # [s] of control, by which a jump is judged
WARM_UP = 20  # decodes before the clock counts: the first ones build programs
PAPER_MS = {"task": 12.0, "erj": 19.0, "era": 13.0}  # computation and execution times that the paper reports


class Condition(NamedTuple):
    """Actions of one size in one space, around one kind of states, through one solver."""

    space: str
    mode: str
    around: str
    damped: bool
    size: float  # [m]


def study_validity(arm: Arm, demos: Demos, samples: int, workers: int, advance: Advance) -> dict[str, Any]:
    """Draw and decode actions under every condition; return everything as JSON.

    Args:
        arm: An arm with one redundant joint and frames for the arm angle.
        demos: Demonstrations, whose measured joint angles are the states.
        samples: Actions per condition.
        workers: Number of worker processes; with one, no process is started.

    Raises:
        ArmError: ERJ or ERA does not suit the arm.
    """
    for space in SPACES:
        make_arm_space(space, arm)  # told before anything starts
    measured = np.concatenate([path.measured for paths in demos.values() for path in paths])
    rng = np.random.default_rng(0)
    states = {
        "demos": measured[rng.integers(len(measured), size=samples)],
        "random": rng.uniform(arm.lower, arm.upper, (samples, arm.dof)),
    }
    jobs = [
        (measure, Condition(space, mode, around, damped, size), arm, states[around])
        for around, mode, damped, space, size in itertools.product(states, SCALES, (True, False), SPACES, SIZES)
    ]
    actions = pd.concat(run_jobs(jobs, workers, advance))
    report = {
        "sizes_m": list(SIZES),
        "turn_rad_per_m": TURN,
        "period_s": PERIOD,
        "paper_ms": PAPER_MS,
        "pooled": _summary(actions, *Condition._fields[:-1]),  # the sizes taken together
        "cells": _summary(actions, *Condition._fields),
    }
    return report | {"findings": findings(report)}


def measure(condition: Condition, arm: Arm, states: Array) -> pd.DataFrame:
    """Draw an action at each state (N, n) [rad], and decode it.

    Returns:
        A row per action: the condition's fields, ``status``, ``iterations`` and ``latency`` [s of processor time].
    """
    absolute = make_arm_space(condition.space, arm)
    assert isinstance(absolute, PoseSpace)
    absolute = replace(absolute, damped=condition.damped)
    bounds = DeltaBounds(condition.size, TURN * condition.size, TURN * condition.size)
    space = DeltaSpace(arm, absolute, bounds) if condition.mode == "delta" else absolute
    rng = np.random.default_rng([list(SCALES).index(condition.mode), SIZES.index(condition.size)])
    scales = condition.size * SCALES[condition.mode]
    shape = len(states), len(scales)
    errors = scales * (rng.uniform(-1.0, 1.0, shape) if condition.mode == "delta" else rng.normal(size=shape))
    meant = np.array([space.encode(q) for q in states])
    actions = meant + errors[:, : space.dim]  # the pose comes first, so that its errors are the same in all spaces
    commander = Commander(space, PERIOD)
    rows = []
    for q, action in zip([*states[:WARM_UP], *states], [*meant[:WARM_UP], *actions], strict=True):
        commander.reset(q)
        started = time.thread_time()  # not the wall's: other processes do not count
        command = commander.command(action, q)
        latency = time.thread_time() - started
        rows.append({"status": command.status, "iterations": command.iters, "latency": latency})
    return pd.DataFrame(rows[-len(states) :]).assign(**condition._asdict())


def _summary(actions: pd.DataFrame, *keys: str) -> list[dict[str, Any]]:
    """A row per value of the keys."""
    rows = []
    for _, part in actions.groupby(list(keys), sort=False):
        statuses, count = Counter(part["status"]), len(part)
        causes = {status.value: statuses[status] for status in Status if status is not Status.OK}
        invalid = sum(causes.values())
        found: dict[str, Any] = {
            "actions": count,
            "invalid": invalid,
            "invalid_rate": invalid / count,
            "causes": causes,
        }
        found["interval"] = exact_interval(invalid, count)
        for share in (50, 99):
            found[f"iterations_p{share}"] = float(np.percentile(part["iterations"], share))
            found[f"decode_p{share}_ms"] = 1e3 * float(np.percentile(part["latency"], share))
        rows.append(part[list(keys)].iloc[0].to_dict() | found)
    return rows
