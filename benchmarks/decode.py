"""How long decoding takes and how exact it is, beside other libraries' inverse kinematics on the same targets.

    uv run --group peers python benchmarks/decode.py  # results/decode/report.json, README.md
    uv run python docs/render_readme.py  # the table of docs/speed.md

One thread. The solvers take turns, in random order, on blocks of targets, so that they share what disturbs the machine;
times are the thread's processor time. Each solution is checked by er_il's forward kinematics, outside of the timing.
Without the dependency group ``peers``, what needs it is left out.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import tyro
from numpy.typing import ArrayLike
from peers import peers, versions
from rich.progress import Progress
from scipy.spatial.transform import Rotation
from solvers import POSITION_TOLERANCE, ROTATION_TOLERANCE, Solution, Solver, Target, is_met, own_solvers
from threadpoolctl import threadpool_limits

from er_il import Arm, Status, make_action_space
from er_il.arms.arm import Vector
from er_il.report.decode_page import write_page
from er_il.spaces.round_trip import EXACT, SINGULAR
from er_il.support.atomic_files import write_json
from er_il.support.provenance import provenance

ARM = "panda"
NEAR, FAR = 0.03, 0.3  # [rad] how far each joint of a seed may be from the target's
AT_LIMIT = 1e-6  # [rad] from a limit: a joint there is at it, whatever the rounding of angles
SLACK = 1e-6  # [rad] by which a solution may pass a limit: programs keep limits to a tolerance of their own
BLOCK = 20  # targets of a turn
BATCHES = (1, 5, 10, 20, 50, 100, 1000)  # actions decoded together
SINGLES = 50  # of them at most are decoded one by one, too
REPETITIONS = 5  # of which the quickest counts

Draw = Callable[[np.random.Generator], Vector]  # joint angles (n,) [rad] of a target


def scenarios(arm: Arm) -> dict[str, tuple[Draw, float]]:
    """By name, how targets are drawn, and how far each joint of a seed may be from them [rad].

    Joint angles are uniform within the limits, as far as the scenario allows.
    """
    conditioning = make_action_space("erj", arm).arm_space.conditioning

    def draw(rng: np.random.Generator, *, singular: bool = False, at_limit: bool = False) -> Vector:
        while True:
            q = rng.uniform(arm.lower, arm.upper)
            if at_limit:
                joint, ends = rng.integers(arm.dof), (arm.lower + AT_LIMIT, arm.upper - AT_LIMIT)
                q[joint] = ends[rng.integers(2)][joint]
            if (conditioning(q) < SINGULAR) == singular:
                return q

    return {
        f"Seed ± {NEAR} rad": (draw, NEAR),
        f"Seed ± {FAR} rad": (draw, FAR),
        "Near a singularity of ERJ": (lambda rng: draw(rng, singular=True), NEAR),
        "A joint at its limit": (lambda rng: draw(rng, at_limit=True), NEAR),
    }


def measure(solvers: Sequence[Solver], targets: Sequence[Vector], seeds: Sequence[Vector]) -> list[dict[str, float]]:
    """Let every solver solve for every target (n,) [rad] from its seed; return the numbers of each solver."""
    rng = np.random.default_rng(0)
    commands = {solver: [solver.target(q) for q in targets] for solver in solvers}
    solutions: dict[Solver, dict[int, Solution]] = {solver: {} for solver in solvers}
    seconds = {solver: np.empty(len(targets)) for solver in solvers}
    blocks = [range(at, min(at + BLOCK, len(targets))) for at in range(0, len(targets), BLOCK)]
    for block in (blocks[0], *blocks):  # the first twice: what is built on first use is no part of a decode
        for turn in rng.permutation(len(solvers)):
            solver = solvers[turn]
            for i in block:
                started = time.thread_time()
                solutions[solver][i] = solver.solve(commands[solver][i], seeds[i])
                seconds[solver][i] = time.thread_time() - started
    return [_numbers(each, commands[each], targets, solutions[each], seconds[each]) for each in solvers]


def _numbers(
    solver: Solver, commands: list[Target], targets: Sequence[Vector], solutions: dict[int, Solution], seconds: Vector
) -> dict[str, float]:
    found = [solutions[i] for i in range(len(targets))]
    checks = pd.DataFrame(
        _check(solver, command, q, each.q) for command, q, each in zip(commands, targets, found, strict=True)
    )
    return {
        "solved": int(checks["solved"].sum()),
        "returned": int((checks["joints"] <= EXACT).sum()),
        **_percentiles("decode_{}_ms", 1e3 * seconds),
        **_percentiles("iterations_{}", [each.iterations for each in found]),
        **_percentiles("position_error_{}_m", checks["position"]),
        **_percentiles("rotation_error_{}_rad", checks["rotation"]),
        **_percentiles("joint_error_{}_rad", checks["joints"]),
    }


class Check(NamedTuple):
    """How well joint angles do what was commanded."""

    position: float  # [m]
    rotation: float  # [rad]
    joints: float  # [rad] of the joint that is farthest from the one whose pose was commanded
    solved: bool  # within the limits they meet all that the solver was given


def _check(solver: Solver, target: Target, q: Vector, found: Vector) -> Check:
    """Check what was found for joint angles q (n,) [rad]."""
    arm, reached = solver.arm, solver.target(found)
    R = target.T_base_ee[:3, :3].T @ reached.T_base_ee[:3, :3]
    off = np.abs((reached.values - target.values + np.pi) % (2.0 * np.pi) - np.pi)
    within = np.all((found >= arm.lower - SLACK) & (found <= arm.upper + SLACK))
    return Check(
        position=float(np.linalg.norm(reached.T_base_ee[:3, 3] - target.T_base_ee[:3, 3])),
        rotation=float(Rotation.from_matrix(R).magnitude()),
        joints=float(np.abs(found - q).max()),
        solved=bool(within and np.all(off <= ROTATION_TOLERANCE)) and is_met(target.T_base_ee, reached.T_base_ee),
    )


def _percentiles(name: str, numbers: ArrayLike) -> dict[str, float]:
    return {name.format(f"p{share}"): float(np.percentile(np.asarray(numbers), share)) for share in (50, 99)}


def measure_batches(arm: Arm, largest: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Time of a batch of actions beside that of the same actions one by one, by space and number of actions.

    Configurations lie around the arm's home posture, seeds within ``NEAR`` of each joint.
    """
    rows = []
    for kind in ("task", "erj", "era"):
        space = make_action_space(kind, arm).arm_space
        for count in (*BATCHES, largest):
            q = arm.within_limits(arm.home + rng.uniform(-FAR, FAR, (count, arm.dof)))
            actions, seeds = space.encode(q), arm.within_limits(q + rng.uniform(-NEAR, NEAR, q.shape))
            few = [*zip(actions[:SINGLES], seeds[:SINGLES], strict=True)]
            together, apart = [], []
            for _ in range(REPETITIONS if count < largest else 1):
                started = time.thread_time()
                decoded = space.decode_batch(actions, seeds)
                between = time.thread_time()
                single = [space.decode(*each) for each in few]
                together.append((between - started) / count)
                apart.append((time.thread_time() - between) / len(few))
            both = (decoded.status[: len(few)] == Status.OK) & [each.status is Status.OK for each in single]
            apart_by = np.abs(decoded.q[: len(few)] - [each.q for each in single]).max(axis=1)[both].max()
            numbers = {"batch_ms": 1e3 * min(together), "single_ms": 1e3 * min(apart)}
            agreement = {"solved": int((decoded.status == Status.OK).sum()), "largest_difference_rad": float(apart_by)}
            rows.append({"space": kind, "actions": count} | numbers | agreement)
    return rows


def main(
    targets: int = 1000, rng_seed: int = 0, largest_batch: int = 1_000_000, out: Path = Path("results/decode")
) -> None:
    """Measure all solvers in all scenarios, and batches; write the report and its page."""
    arm = Arm.preset(ARM)
    solvers = [*own_solvers(arm), *peers(arm)]
    rows = []
    with Progress() as progress, threadpool_limits(1):
        bar = progress.add_task("Scenarios", total=len(scenarios(arm)))
        for name, (draw, seed_error) in scenarios(arm).items():
            rng = np.random.default_rng(rng_seed)
            wanted = [draw(rng) for _ in range(targets)]
            seeds = [np.clip(q + rng.uniform(-seed_error, seed_error, arm.dof), arm.lower, arm.upper) for q in wanted]
            for solver, numbers in zip(solvers, measure(solvers, wanted, seeds), strict=True):
                how = {"scenario": name, "solver": solver.name, "space": solver.kind, "commands": solver.commands}
                rows.append(how | {"seed_error": seed_error, "targets": targets} | numbers)
            progress.advance(bar)
    meta = provenance()
    meta["versions"] |= versions()
    meta |= {"arm": ARM, "rng_seed": rng_seed, "exact": EXACT, "ill_conditioned": SINGULAR}
    meta |= {"position_tolerance_m": POSITION_TOLERANCE, "rotation_tolerance_rad": ROTATION_TOLERANCE}
    batches = measure_batches(arm, largest_batch, np.random.default_rng(rng_seed))
    write_json(out / "report.json", {"meta": meta, "decodes": rows, "batches": batches})
    write_page(out)


if __name__ == "__main__":
    tyro.cli(main)
