"""The jobs of an experiment: recording demonstrations, training policies, rolling out, filming; each leaves files."""

import json
import os
import re
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

from er_il.datasets.record import read_episodes
from er_il.datasets.recording import generate
from er_il.envs.contract import dataset_info
from er_il.evaluation.elbow import ElbowReference
from er_il.evaluation.posture_baselines import POSTURE_BASELINES, POSTURE_DECODER
from er_il.evaluation.recording import record_rollout
from er_il.evaluation.results import save_rollouts
from er_il.evaluation.rollouts import evaluate
from er_il.experiments.grid import Grid
from er_il.experiments.schedule import FileResult, Job
from er_il.policy.configuration import default_config
from er_il.policy.training import PRECISION, Training, train_episodes
from er_il.report.films import write_film
from er_il.spaces.registry import arm_space_from_spec
from er_il.spaces.spec import action_spec
from er_il.support.atomic_files import write_json
from er_il.support.cost import Cost, measured
from er_il.support.errors import ErIlError
from er_il.support.provenance import git_sha

FILM_EVERY = 2  # control steps a picture: shadows make each expensive
_LOGGED_STEP = re.compile(r"step:([\d.]+)(K?)")  # as lerobot-train logs it


@dataclass(frozen=True)
class Demonstrate(FileResult):
    """Record the demonstrations of a grid's task, once, and encode them in each space."""

    task: str
    grid: Grid = field(hash=False)
    spaces: tuple[str, ...]
    path: Path  # folder of the datasets, one a space
    workers: int  # processes that record

    stage = "Record"
    needs = ()

    @property
    def name(self) -> str:
        return f"demonstrate {self.task}"

    @property
    def size(self) -> int:
        return self.grid.recipe(self.task).episodes

    @property
    def done(self) -> bool:
        return all((self.path / space).exists() for space in self.spaces)

    def run(self) -> None:
        """Record and encode what is missing."""
        with Progress(disable=True) as progress:
            generate(self.grid.recipe(self.task), self.spaces, self.path, progress, self.workers)


@dataclass(frozen=True)
class Train(FileResult):
    """Train the policy of a space with LeRobot's own command."""

    task: str
    space: str
    dataset: Path
    path: Path  # of the notes on the policy: its cost and origin; there once it is trained
    steps: int
    seed: int
    demonstrations: int  # the first ones of the training episodes
    configuration: str = ""  # kind of the shipped one, such as images_small; from states if empty
    needs: tuple[Job, ...] = ()

    stage = "Train"

    @property
    def name(self) -> str:
        return f"train {self.task} {self.space} on {self.demonstrations} demonstrations, seed {self.seed}"

    @property
    def out(self) -> Path:
        """Folder of the training, beside its notes and its log."""
        return self.path.with_suffix("")

    @property
    def training(self) -> Training:
        """The training; the dataset must be there."""
        config = default_config(self.space, self.configuration)
        return Training(
            self.task, self.space, self.dataset, self.out, config, self.steps, self.seed, self.demonstrations
        )

    @property
    def size(self) -> int:
        return self.steps

    @property
    def progress(self) -> int:
        try:
            steps = _LOGGED_STEP.findall(self.log.read_text())
        except OSError:
            return 0
        return int(float(steps[-1][0]) * (1000 if steps[-1][1] else 1)) if steps else 0

    def run(self) -> None:
        """Train, or go on where the training was interrupted.

        Raises:
            ErIlError: lerobot-train failed; its log says why.
        """
        training = self.training
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with measured() as cost:
            if not training.finished:
                with self.log.open("w") as file:
                    code = training.run(file)
                if code:
                    raise ErIlError(f"lerobot-train ended with exit code {code}.")
        write_json(self.path, _notes(cost) | {"mixed_precision": os.environ.get(PRECISION, "no")})

    def read_notes(self) -> dict[str, Any]:
        """Cost and origin of the trained policy."""
        return json.loads(self.path.read_text())


@dataclass(frozen=True)
class RollOut(FileResult):
    """Roll a trained policy out through a decoder, on some of the initial states."""

    trained: Train
    decoder: str  # a decoder, or a posture baseline
    first_seed: int
    count: int
    path: Path  # of the result

    stage = "Roll out"

    @property
    def name(self) -> str:
        last = self.first_seed + self.count - 1
        return f"roll out {self.decoder} from {self.first_seed} to {last} ({self.trained.name})"

    @property
    def size(self) -> int:
        return self.count

    @property
    def needs(self) -> tuple[Job, ...]:
        return (self.trained,)

    def run(self) -> None:
        """Roll out and write the rollouts, with what they cost."""
        leader, elbow = _demonstrated(self.trained.dataset, self.trained.demonstrations)
        posture = POSTURE_BASELINES.get(self.decoder)
        with measured() as cost:
            rollouts = evaluate(
                self.trained.training.policy,
                self.trained.task,
                POSTURE_DECODER if posture else self.decoder,
                episodes=self.count,
                seed=self.first_seed,
                posture=posture(leader).tolist() if posture else (),
                elbow=elbow,
            )
        save_rollouts(rollouts, self.path, _notes(cost))


@dataclass(frozen=True)
class Film(FileResult):
    """Record one rollout of a trained policy: as a film (.mp4), a Rerun recording (.rrd) and a trace (.npz)."""

    trained: Train
    decoder: str
    seed: int  # of the initial state
    path: Path  # of the trace, written last

    stage = "Film"

    @property
    def name(self) -> str:
        return f"film {self.trained.task} through {self.decoder} from {self.seed}"

    @property
    def needs(self) -> tuple[Job, ...]:
        return (self.trained,)

    @property
    def film(self) -> Path:
        """The film."""
        return self.path.with_suffix(".mp4")

    @property
    def files(self) -> tuple[Path, ...]:
        """All that it makes."""
        return self.film, self.path.with_suffix(".rrd"), self.path

    def run(self) -> None:
        """Roll out, film and record.

        Raises:
            RenderError: the machine cannot render.
        """
        from er_il.viewer import save_rollout

        policy = self.trained.training.policy
        trace, pictures = record_rollout(policy, self.trained.task, self.decoder, self.seed, FILM_EVERY)
        write_film(pictures, self.film, round(1 / trace.period / FILM_EVERY))
        save_rollout(trace, self.path.with_suffix(".rrd"))
        trace.save(self.path)


@lru_cache(maxsize=4)  # jobs of one policy follow one another
def _demonstrated(dataset: Path, count: int) -> tuple[list[NDArray[np.float64]], ElbowReference | None]:
    """The leader's paths (T, n + 1) [rad and opening] that a policy was trained on, and where the elbow was."""
    info = dataset_info(dataset)
    arm = arm_space_from_spec(action_spec(info["features"])).arm
    episodes = read_episodes(dataset)
    chosen = [episodes[i] for i in train_episodes(info)[:count]]
    followed = [demo.state[:, : arm.dof].astype(np.float64) for demo in chosen]
    leader = [demo.leader.astype(np.float64) for demo in chosen]
    return leader, ElbowReference.of_demos(arm, 1 / info["fps"], followed)


def _notes(cost: Cost) -> dict[str, Any]:
    return {"cost": asdict(cost), "git": git_sha()}
