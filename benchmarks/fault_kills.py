"""Commands killed at any moment, run again, and compared with a run that nothing disturbed."""

import hashlib
import json
import shutil
import signal
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from faulty import LOG, start

from er_il.rl.settings import Settings

# What commands write that differs between two undisturbed runs as well: times, places, and films, whose encoder draws
# its identifiers.
_VOLATILE = {"train_config.json", "README.md", "benchmark.json", "results.json"}
_COMPARED = {".parquet", ".json", ".safetensors", ".png", ".gz", ".mp4"}
_TIMES = ("cpu", "latenc", "wall", "decode")  # in the names of JSON entries
EARLY = "ended before"
_PATIENCE = 600.0  # [s] until a command that does not end counts as hanging


@dataclass(frozen=True)
class Command:
    """A command of er-il that writes a folder ``out``."""

    name: str
    arguments: tuple[str, ...]
    share: int  # of the kills
    workers: int = 1  # one is the command's own process

    def run(self, folder: Path) -> BaseProcess:
        """Start it in a folder."""
        return start(self.arguments, folder, self.workers)


def commands(data: Path) -> tuple[Command, ...]:
    """The commands to kill, given a folder with a dataset ``erj`` of demonstrations of Push Button."""
    few = ("--episodes", "3", "--spaces", "joint,erj", "--out", "out")
    grid = data / "grid.yaml"
    grid.write_text(
        "title: Killed\ntasks: [push_button_elbow]\ndecoders: [joint, task-nearest]\ndemonstrations: [1]\n"
        "training_seeds: [0]\nrollouts: 2\nepisodes: 2\nsteps: 2\n"
    )
    demo = ("--task", "push_button_elbow", "--decoders", "task-nearest", "--demonstrations", "2", "--steps", "2")
    images = ("--cameras", "wrist", "--size", "32")
    train = ("train", "push_button_elbow", "erj", "--dataset", str(data / "erj"), "--steps", "4", "--out", "out")
    settings = data / "sac.yaml"
    values = Settings.shipped(pixels=False).to_dict()
    few_steps = {"environments": 2, "warm_up": 40, "batch_size": 16, "milestone": 64, "evaluations": 1}
    settings.write_text(json.dumps(values | few_steps))
    learn = ("--steps", "320", "--config", str(settings))
    return (
        Command("generate", ("generate", "push_button_elbow", *few), 30),
        Command("generate with a camera", ("generate", "push_button_elbow", *few, *images), 16),
        Command("encode", ("encode", str(data / "erj"), "--to", "era", "--out", "out"), 24),
        Command("train", train, 12),
        Command("rl train", ("rl", "train", "reach_target", "task", *learn, "--out", "out"), 12),
        Command("benchmark", ("benchmark", str(grid), "--out", "out", "--results", "results"), 10, workers=2),
        Command("demo", ("demo", *demo, "--rollouts", "2", "--out", "out"), 8, workers=2),
    )


def kill(command: Command, undisturbed: "Undisturbed", moment: float, worker: bool, folder: Path) -> str:
    """Kill a command once at a share of its time, run it again, and compare.

    Args:
        command: What to run.
        undisturbed: The same command without a kill.
        moment: Share of the undisturbed time after which it is killed.
        worker: True to kill a process that the command started, if there is one then; else all of them at once.
        folder: Empty folder to work in.

    Returns:
        What went wrong; "" if nothing did, ``EARLY`` if there was nothing to kill, or nothing left to do.
    """
    process = command.run(folder)
    process.join(moment * undisturbed.seconds)
    if not process.is_alive():
        return EARLY if process.exitcode == 0 else f"exit code {process.exitcode} without a kill"
    assert process.pid is not None
    children = psutil.Process(process.pid).children(recursive=True)
    for victim in [*children[-1:]] if worker and children else [psutil.Process(process.pid), *children]:
        with suppress(psutil.NoSuchProcess):
            victim.send_signal(signal.SIGKILL)
    if worker and children:
        process.join(_PATIENCE)  # the command replaces the worker, or ends and says so
    process.join(_PATIENCE)
    if contents(folder) == undisturbed.contents:
        return EARLY
    again = command.run(folder)
    again.join(_PATIENCE)
    if again.is_alive():
        again.kill()
        return "hangs when it is run again"
    if again.exitcode != 0:
        said = (folder / LOG).read_text(errors="replace").strip().splitlines()
        return f"exit code {again.exitcode} when it is run again: {said[-1] if said else ''}"
    found = contents(folder)
    wanted = undisturbed.contents
    different = sorted(name for name in found.keys() | wanted.keys() if found.get(name) != wanted.get(name))
    return f"differs in {', '.join(different[:3])}" if different else ""


def _kill_in(folder: Path, command: Command, undisturbed: "Undisturbed", moment: float, worker: bool) -> str:
    """:func:`kill` in a folder that is there for it alone."""
    folder.mkdir()
    try:
        return kill(command, undisturbed, moment, worker, folder)
    finally:
        shutil.rmtree(folder)


@dataclass(frozen=True)
class Undisturbed:
    """A run that nothing disturbed."""

    seconds: float
    contents: Mapping[str, str]

    @classmethod
    def of(cls, command: Command, folder: Path) -> "Undisturbed":
        """Run the command twice: what differs between two such runs is not compared."""
        results, seconds = [], 0.0
        for name in ("first", "second"):
            (folder / name).mkdir()
            started = time.monotonic()
            process = command.run(folder / name)
            process.join(_PATIENCE)
            seconds = time.monotonic() - started  # the second does not start the fork server
            if process.exitcode != 0:
                raise RuntimeError(f"{command.name} fails: {(folder / name / 'log.txt').read_text()[-500:]}")
            results.append(contents(folder / name))
        if results[0] != results[1]:
            different = [name for name in results[0] if results[0][name] != results[1].get(name)]
            raise RuntimeError(f"Two undisturbed runs of {command.name} differ in {', '.join(different)}.")
        return cls(seconds, results[1])


def contents(folder: Path) -> dict[str, str]:
    """Digest by name of what a command wrote, but for what two undisturbed runs differ in."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_file() and path.suffix in _COMPARED and path.name not in _VOLATILE and "films" not in path.parts:
            content = path.read_bytes()
            if path.suffix == ".json":
                with suppress(ValueError):  # what was killed while it was written
                    content = json.dumps(_steady(json.loads(content))).encode()
            found[name] = hashlib.sha256(content).hexdigest()
    return found


def _steady(value: Any) -> Any:
    """JSON without the entries that are times, its numbers to 9 digits.

    What inverse kinematics leaves free differs between two processes in the last bits; an action is a float32.
    """
    if isinstance(value, float):
        return float(f"{value:.9g}")
    if isinstance(value, dict):
        return {key: _steady(each) for key, each in value.items() if not any(word in key for word in _TIMES)}
    return [_steady(each) for each in value] if isinstance(value, list) else value


def kill_often(index: int, kills: int, seed: int, data: Path, folder: Path) -> dict[str, Any]:
    """Kill the command of this index of :func:`commands` at moments spread over its time; count what is not resumed."""
    command = commands(data)[index]
    rng = np.random.default_rng([seed, index])
    folder.mkdir()
    undisturbed = Undisturbed.of(command, folder)
    moments = rng.permutation((np.arange(kills) + rng.random(kills)) / kills)
    wrong = []
    for number, moment in enumerate(moments.tolist()):
        # On a machine that was busier before, a command ends sooner than the undisturbed one.
        while (fault := _kill_in(folder / "killed", command, undisturbed, moment, number % 3 == 2)) == EARLY:
            moment *= rng.random()
        if fault:
            wrong.append({"moment": round(moment, 3), "fault": fault})
    return {"command": command.name, "kills": kills, "not_resumed": len(wrong), "faults": wrong}
