"""The paper's study of invalid actions: how many there are in each space, why, and what decoding them costs.

Actions are drawn around states of demonstrations and around random configurations:

- delta, as a policy that knows nothing yet (the paper's RL): every change uniform within plus and minus the size;
- absolute, as a policy that has learnt the state: every number off by a normal error of the size.

A size is in metres; rotations and angles go with it by ``TURN`` rad a metre. All spaces get the same
states, the same errors of the pose and, where they have one, of the redundancy value. An action is
invalid if the arm could not follow it: :class:`er_il.kinematics.solver.Status` says why.
"""

import itertools
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.control.commander import Commander
from er_il.evaluation.statistics import exact_interval
from er_il.kinematics.solver import Status
from er_il.spaces.base import ArmSpace
from er_il.spaces.delta import DeltaBounds, DeltaSpace
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space
from er_il.support.workers import run_jobs

Array = NDArray[np.float64]

SPACES = ("task", "erj", "era")
MODES = ("delta", "absolute")
DEMOS, RANDOM = "demos", "random"
SIZES = (0.01, 0.02, 0.05, 0.1, 0.2)  # [m]
TURN = 3.0  # [rad/m] the ratio of a delta space's declared bounds
PERIOD = 0.05  # [s] of control, by which a jump is judged
WARM_UP = 20  # decodes before the clock counts: the first ones build programs


@dataclass(frozen=True)
class Cell:
    """Actions of one size in one space, around one kind of states, through one solver."""

    space: str
    mode: str
    around: str
    damped: bool
    size: float  # [m]


@dataclass(frozen=True)
class Outcome:
    """What became of a cell's actions."""

    cell: Cell
    statuses: Counter[str]
    iterations: tuple[int, ...]
    latencies: tuple[float, ...]  # [s] of processor time

    @property
    def actions(self) -> int:
        """Number of actions."""
        return self.statuses.total()

    def report(self) -> dict[str, Any]:
        """Return the outcome as JSON."""
        invalid = self.actions - self.statuses[Status.OK]
        p50, p99 = (1e3 * np.percentile(self.latencies, [50, 99])).tolist()
        return vars(self.cell) | {
            "actions": self.actions,
            "invalid": invalid,
            "invalid_rate": invalid / self.actions,
            "interval": exact_interval(invalid, self.actions),
            "causes": {status.value: self.statuses[status] for status in Status if status is not Status.OK},
            "iterations_p50": float(np.percentile(self.iterations, 50)),
            "iterations_p99": float(np.percentile(self.iterations, 99)),
            "decode_p50_ms": p50,
            "decode_p99_ms": p99,
        }


def study_validity(
    arm: Arm, demos: Array, samples: int, workers: int, advance: Callable[[int, int], object]
) -> list[Outcome]:
    """Draw and decode actions in every cell.

    Args:
        arm: An arm with one redundant joint and frames for the arm angle.
        demos: Joint angles (N, n) [rad] measured along demonstrations.
        samples: Actions a cell.
        workers: Number of worker processes; with one, no process is started.
        advance: Called with the number of cells done, and their total.

    Raises:
        ArmError: ERJ or ERA does not suit the arm.
    """
    for space in SPACES:
        make_arm_space(space, arm)  # told before anything starts
    rng = np.random.default_rng(0)
    states = {
        DEMOS: demos[rng.integers(len(demos), size=samples)],
        RANDOM: rng.uniform(arm.lower, arm.upper, (samples, arm.dof)),
    }
    cells = [
        Cell(space, mode, around, damped, size)
        for around, mode, damped, space, size in itertools.product(states, MODES, (True, False), SPACES, SIZES)
    ]
    jobs = [(measure, cell, arm, states[cell.around]) for cell in cells]
    return run_jobs(jobs, workers, advance)


def measure(cell: Cell, arm: Arm, states: Array) -> Outcome:
    """Draw an action at each state (N, n) [rad], and decode it."""
    absolute = make_arm_space(cell.space, arm)
    assert isinstance(absolute, PoseSpace)
    absolute = replace(absolute, damped=cell.damped)
    bounds = DeltaBounds(cell.size, TURN * cell.size, TURN * cell.size)
    space = DeltaSpace(arm, absolute, bounds) if cell.mode == "delta" else absolute
    rng = np.random.default_rng([MODES.index(cell.mode), SIZES.index(cell.size)])
    commander = Commander(space, PERIOD)
    statuses, iterations, latencies = Counter[str](), [], []
    for q in states[:WARM_UP]:
        commander.reset(q)
        commander.command(space.encode(q), q)
    for q in states:
        action = _changed(space, cell, q, rng)
        commander.reset(q)
        started = time.thread_time()  # not the wall's: other processes do not count
        command = commander.command(action, q)
        latencies.append(time.thread_time() - started)
        statuses[command.status] += 1
        iterations.append(command.iters)
    return Outcome(cell, statuses, tuple(iterations), tuple(latencies))


def _changed(space: ArmSpace, cell: Cell, q: Vector, rng: np.random.Generator) -> Array:
    """An action at a state. The errors of the pose come first, so that they are the same in all spaces."""
    action = space.encode(q)
    commands = len(action)
    if cell.mode == "delta":
        scales = np.array([cell.size] * 3 + [TURN * cell.size] * 4)[:commands]
        errors = rng.uniform(-1.0, 1.0, 7)[:commands]
    else:  # a quaternion's numbers change by half the angle
        scales = np.array([cell.size] * 3 + [TURN * cell.size / 2] * 4 + [TURN * cell.size])[:commands]
        errors = rng.normal(size=8)[:commands]
    action[:commands] += scales * errors
    return action
