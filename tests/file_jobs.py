"""Small real jobs with a file as result: simulating, failing, or killing the process that runs them."""

import json
import os
import signal
import time
from concurrent.futures import Future
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium

import sim_tasks  # noqa: F401  registers the tasks
from er_il.experiments.schedule import Job
from er_il.support.atomic_files import write_atomically


@dataclass(frozen=True)
class FileJob(Job):
    """Writes what it computed from its seed and from the files it needs."""

    name: str = field(init=False)
    needs: "tuple[FileJob, ...]" = ()
    size: int = 1
    seed: int = 0
    accident: str = ""  # "fail": raises; "die": kills its process the first time
    sleep: float = 0.0  # [s]

    stage = "Compute"

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", self.path.stem)  # frozen, as all jobs are

    @property
    def runs(self) -> int:
        """How often it was run."""
        return self._started.read_text().count("\n") if self._started.exists() else 0

    @property
    def _started(self) -> Path:
        return self.path.with_suffix(".started")

    def run(self) -> None:
        with self._started.open("a") as file:
            file.write(f"{os.getpid()}\n")
        if self.accident == "fail":
            raise RuntimeError("as it was told")
        if self.accident == "die" and self.runs == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(self.sleep)
        result = simulated(self.seed)
        for need in self.needs:
            result += json.loads(need.path.read_text())
        write_atomically(self.path, lambda path: path.write_text(json.dumps(result)))


@dataclass
class InOrder:
    """Runs one function after the other in this process, and keeps what it ran."""

    workers: int = 1
    ran: list[str] = field(default_factory=list)

    def submit(self, function: Any, /, *arguments: Any) -> "Future[Any]":
        self.ran.append(arguments[0].name)
        future: Future[Any] = Future()
        future.set_result(function(*arguments))
        return future


def simulated(seed: int) -> list[float]:
    """Where an arm is after half a second of holding still, from an initial state of its seed."""
    world = gymnasium.make("sim_tasks/LiftCup-v0")
    observation, _ = world.reset(seed=seed)
    for _ in range(10):
        observation, *_ = world.step(observation["agent_pos"][:8])
    world.close()
    return observation["agent_pos"].tolist()


def graph(folder: Path, **changes: str) -> list[FileJob]:
    """Four jobs, two of which need the result of a fifth; ``changes`` are accidents by name."""
    folder.mkdir(parents=True, exist_ok=True)

    def job(name: str, seed: int, *needs: FileJob) -> FileJob:
        return FileJob(folder / f"{name}.json", needs, seed=seed, accident=changes.get(name, ""), sleep=0.2)

    root = job("root", 5)
    return [job("a", 1, root), job("b", 2, root), job("c", 3), job("d", 4)]
