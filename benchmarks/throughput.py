"""Speed and memory: environment steps through each action space, and the commands on datasets and policies.

    uv run python benchmarks/throughput.py  # results/throughput/report.json

Everything runs on one core with one thread, and costs are processor seconds, which other work on the machine hardly
changes. Each command is a process of its own; counted are its descendants, too, such as LeRobot's worker processes.
Its memory is that of the largest process. Linux only.
"""

import contextlib
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import gymnasium
import numpy as np
import tyro
from lerobot.datasets.aggregate import aggregate_datasets
from rich.progress import Progress

from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.envs.decoders import Decoder
from er_il.envs.protocol import demonstrable_env
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import make_action_space_env
from er_il.policy.configuration import default_config
from er_il.policy.training import Training
from er_il.support.atomic_files import write_json
from er_il.support.errors import PlanError
from er_il.support.provenance import provenance
from er_il.support.workers import ONE_THREAD

SPACES = ("joint", "task", "erj", "era")
STEPPED = "lift_cup"  # the task whose environment is stepped
TASK, SPACE, DEMOS = "reach_cup", "erj", 8  # of the datasets and the policy
FIRST_SEED = 0  # of the episodes that are stepped
REPO = "er_il/throughput"
BENCHMARKS = Path(__file__).parent


def step_rates(episodes: int) -> list[dict[str, object]]:
    """Step the environment along encoded demonstrations, the spaces in turn; one row a space."""
    worlds = {space: make_action_space_env(STEPPED, Decoder(space)) for space in SPACES}
    steps, seconds = dict.fromkeys(SPACES, 0), dict.fromkeys(SPACES, 0.0)
    for seed, joints in demonstrations(episodes):
        for space, world in worlds.items():
            actions = np.column_stack([world.space.encode(joints[:, :-1]), joints[:, -1]]).astype(np.float32)
            world.reset(seed=seed)
            started = time.process_time()
            for action in actions:
                _, _, terminated, truncated, _ = world.step(action)
                steps[space] += 1
                if terminated or truncated:
                    break
            seconds[space] += time.process_time() - started
    rates = {space: steps[space] / seconds[space] for space in SPACES}
    return [
        {
            "space": space,
            "steps": steps[space],
            "cpu_s": round(seconds[space], 3),
            "steps_per_s": round(rate, 1),
            "relative_to_joint": round(rate / rates["joint"], 3),
        }
        for space, rate in rates.items()
    ]


def demonstrations(episodes: int) -> list[tuple[int, np.ndarray]]:
    """The leader's joints and opening (T, n + 1) of the first seeds that it can demonstrate."""
    env = gymnasium.make(task_id(STEPPED))
    found, seed = [], FIRST_SEED
    while len(found) < episodes:
        env.reset(seed=seed)
        with contextlib.suppress(PlanError):
            found.append((seed, np.array(list(demonstrable_env(env).leader(seed)))))
        seed += 1
    return found


def enlarge(source: Path, target: Path, frames: int) -> None:
    """Write a dataset that repeats another until it has at least so many frames."""
    copies = math.ceil(frames / Dataset(source).frames)
    few = math.isqrt(copies - 1) + 1  # in two rounds: LeRobot rewrites a file for each dataset that it adds to it
    part = target.with_name(f"{target.name}_part")
    for repeated, count, result in ((source, few, part), (part, math.ceil(copies / few), target)):
        aggregate_datasets([REPO] * count, REPO, [repeated] * count, result)


def main(
    step_episodes: int = 10,
    verified: int = 100_000,
    encoded: int = 1_000_000,
    steps: int = 300,
    rollouts: int = 50,
    out: Path = Path("results/throughput"),
) -> None:
    """Measure everything; write the report.

    Args:
        step_episodes: Demonstrations along which the environment is stepped.
        verified: Frames of the dataset to verify, or a few more.
        encoded: Frames of the dataset to encode, or a few more.
        steps: Training steps of the policy to roll out.
        rollouts: Number of rollouts.
        out: Folder of the report.
    """
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})  # inherited: no command starts workers
    os.environ |= ONE_THREAD
    rows = []
    with TemporaryDirectory() as name, Progress() as progress:
        folder = Path(name)
        bar = progress.add_task("Throughput", total=6)

        def measure(label: str, counted: dict[str, int], command: Sequence[object]) -> float:
            """Processor seconds of a command."""
            program = Path(sys.executable).with_name(str(command[0]))
            measured = [sys.executable, BENCHMARKS / "usage.py", "log.txt", program, *map(str, command[1:])]
            used = json.loads(subprocess.check_output(measured, cwd=folder))
            rows.append({"command": label} | counted | used)
            progress.advance(bar)
            return used["cpu_s"]

        stepping = f"import json, throughput\nprint(json.dumps(throughput.step_rates({step_episodes})))"
        command = [sys.executable, "-c", stepping]
        stepped = json.loads(subprocess.check_output(command, cwd=BENCHMARKS, text=True).splitlines()[-1])
        progress.advance(bar)

        recipe = Recipe.load(TASK).resized(DEMOS)
        generate(recipe, ["joint", SPACE], folder / "demos", progress, workers=1)
        enlarge(folder / "demos" / SPACE, folder / "verified", verified)
        frames = Dataset(folder / "verified").frames
        measure("er-il verify", {"frames": frames}, ["er-il", "verify", "verified"])
        enlarge(folder / "demos/joint", folder / "large", encoded)
        for kind in ("erj", "era"):
            counted = {"frames": Dataset(folder / "large").frames}
            command = ["er-il", "encode", "large", "--to", kind, "--out", f"large_{kind}"]
            measure(f"er-il encode --to {kind}", counted, command)

        config = default_config(SPACE)
        training = Training(TASK, SPACE, folder / "demos" / SPACE, folder / "policy", config, steps, seed=0)
        with (folder / "training.txt").open("w") as log:
            if code := training.run(log):
                raise RuntimeError(f"The training ended with exit code {code}.")
        own = measure(
            "er-il eval",
            {"rollouts": rollouts},
            ["er-il", "eval", "policy", "--task", TASK, "--decoder", SPACE, "--episodes", rollouts],
        )
        stock = measure(
            "lerobot-eval",
            {"rollouts": rollouts},
            [
                "lerobot-eval",
                "--env.type=er_il",
                f"--env.task={TASK}",
                f"--env.action_space={SPACE}",
                f"--policy.path={training.policy}",
                f"--eval.n_episodes={rollouts}",
                f"--eval.batch_size={min(10, rollouts)}",
            ],
        )
    meta = {
        "task": TASK,
        "space": SPACE,
        "demonstrations": DEMOS,
        "recording_seed": recipe.seed,
        "training_seed": training.seed,
        "training_steps": steps,
        "stepped_task": STEPPED,
        "stepped_demonstrations": step_episodes,
        "first_stepped_seed": FIRST_SEED,
        "cores": 1,
        "threads": 1,
    }
    report = {
        "meta": provenance() | meta,
        "environment_steps": stepped,
        "commands": rows,
        "eval_relative_to_lerobot": round(own / stock, 3),
    }
    write_json(out / "report.json", report)


if __name__ == "__main__":
    tyro.cli(main)
