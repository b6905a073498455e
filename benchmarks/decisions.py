"""Decisions of reinforcement learning: how many a core takes a second, and how many random ones are invalid, by mode.

    uv run python benchmarks/decisions.py  # results/decisions/report.json
    uv run python docs/render_readme.py  # the table of docs/reinforcement_learning.md

From states, on Reach Target, with actions uniform in [-1, 1], as an agent begins. The modes take turns, so that all of
them meet the machine in the same condition. What resets take counts.
"""

import time
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.progress import Progress
from threadpoolctl import threadpool_limits

from er_il.envs.learning import MODES, LearningEnv, make_rl_env
from er_il.spaces.joint import JOINT
from er_il.support.atomic_files import write_json
from er_il.support.provenance import provenance

TASK = "reach_target"


def play(env: LearningEnv, decisions: int, rng: np.random.Generator) -> tuple[float, int]:
    """Processor time [s] of random decisions, and the number of invalid ones."""
    actions = rng.uniform(-1.0, 1.0, (decisions, *(env.action_space.shape or ()))).astype(np.float32)
    env.reset(seed=int(rng.integers(2**31)))
    invalid, start = 0, time.process_time()
    for action in actions:
        _, _, terminated, truncated, info = env.step(action)
        invalid += info["invalid"]
        if terminated or truncated:
            env.reset()
    return time.process_time() - start, invalid


def main(decisions: int = 500, rounds: int = 10, seed: int = 0, out: Path = Path("results/decisions")) -> None:
    """Measure every mode; write the report.

    Args:
        decisions: Decisions of a mode in each round.
        rounds: Number of rounds; the fastest one of each mode counts.
        seed: Seed of the actions and the starts.
        out: Folder of the report.
    """
    envs = {mode: make_rl_env(TASK, mode) for mode in MODES}
    rng = np.random.default_rng(seed)
    found: dict[str, list[tuple[float, int]]] = {mode: [] for mode in MODES}
    with Progress() as progress, threadpool_limits(1):
        for _ in progress.track(range(rounds), description="Decide"):
            for mode, env in envs.items():
                found[mode].append(play(env, decisions, rng))
    rates = {mode: decisions / min(seconds for seconds, _ in runs) for mode, runs in found.items()}
    rows: list[dict[str, Any]] = [
        {
            "mode": mode,
            "decisions": decisions * rounds,
            "per_second": rates[mode],
            "relative_to_joint": rates[mode] / rates[JOINT],
            "invalid_rate": sum(invalid for _, invalid in runs) / (decisions * rounds),
        }
        for mode, runs in found.items()
    ]
    write_json(out / "report.json", {"meta": provenance() | {"seed": seed, "task": TASK}, "decisions": rows})
    for row in rows:
        print(f"{row['mode']}: {row['per_second']:.0f} decisions/s, {row['invalid_rate']:.1%} invalid")


if __name__ == "__main__":
    tyro.cli(main)
