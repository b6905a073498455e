"""Training a policy and rolling it out, as jobs that resume and leave files."""

import json
import os
import re
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.record import read_episodes
from er_il.envs.contract import dataset_info
from er_il.evaluation.elbow import ElbowReference
from er_il.evaluation.posture_baselines import POSTURE_DECODER, SCEPTICS
from er_il.evaluation.results import save_cell
from er_il.evaluation.rollouts import FIRST_SEED, evaluate
from er_il.experiments.schedule import FileResult, Job
from er_il.policy.actor import POLICY_ROWS
from er_il.policy.configuration import default_config, default_steps
from er_il.policy.training import PRECISION, Training, train_episodes
from er_il.spaces.action_space import from_spec
from er_il.spaces.spec import action_spec
from er_il.support.atomic_files import write_json
from er_il.support.cost import Cost, measured
from er_il.support.errors import ErIlError
from er_il.support.provenance import git_sha

_LOGGED_STEP = re.compile(r"step:([\d.]+)(K?)")  # as lerobot-train logs it


@dataclass(frozen=True)
class Train:
    """Train the policy of a space with LeRobot's own command."""

    task: str
    space: str
    dataset: Path
    out: Path  # of the training; its log and its notes lie beside it
    steps: int
    seed: int
    demonstrations: int | None = None  # the first ones of the training episodes; all if None
    configuration: str = ""  # kind of the shipped one, such as images_small; from states if empty
    needs: tuple[Job, ...] = ()

    @property
    def name(self) -> str:
        """What it does, for people."""
        count = "" if self.demonstrations is None else f" on {self.demonstrations} demonstrations"
        return f"train {self.task} {self.space}{count}, seed {self.seed}"

    @property
    def log(self) -> Path:
        """What lerobot-train printed."""
        return self.out.with_name(f"{self.out.name}.log")

    @property
    def notes(self) -> Path:
        """Cost and origin of the policy; there once it is trained."""
        return self.out.with_name(f"{self.out.name}.json")

    @property
    def done(self) -> bool:
        """Whether the policy is trained."""
        return self.notes.exists()

    def read_notes(self) -> dict[str, Any]:
        """Cost and origin of the trained policy."""
        return json.loads(self.notes.read_text())

    @property
    def training(self) -> Training:
        """The training; the dataset must be there."""
        config = default_config(self.space, self.configuration)
        return Training(
            self.task, self.space, self.dataset, self.out, config, self.steps, self.seed, self.demonstrations
        )

    @property
    def logged_steps(self) -> int:
        """Number of steps that the running training has reported."""
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
        write_json(self.notes, _notes(cost) | {"mixed_precision": os.environ.get(PRECISION, "no")})


@dataclass(frozen=True)
class RollOut(FileResult):
    """Roll a trained policy out through a decoder, on some of the initial states."""

    trained: Train
    decoder: str  # a decoder, or one of SCEPTICS
    first_seed: int
    count: int
    path: Path  # of the result

    @property
    def name(self) -> str:
        """What it does, for people."""
        last = self.first_seed + self.count - 1
        return f"roll out {self.decoder} from {self.first_seed} to {last} ({self.trained.name})"

    @property
    def needs(self) -> tuple[Job, ...]:
        """The trained policy."""
        return (self.trained,)

    def run(self) -> None:
        """Roll out and write the cell, with what it cost."""
        demos = _demos(self.trained.dataset, self.trained.demonstrations)
        sceptic = SCEPTICS.get(self.decoder)
        with measured() as cost:
            cell = evaluate(
                self.trained.training.policy,
                self.trained.task,
                POSTURE_DECODER if sceptic else self.decoder,
                episodes=self.count,
                seed=self.first_seed,
                posture=sceptic(demos.leader).tolist() if sceptic else (),
                elbow=demos.elbow,
            )
        save_cell(replace(cell, decoder=self.decoder), self.path, _notes(cost))


def roll_outs(trained: Train, decoder_name: str, rollouts: int, folder: Path) -> list[RollOut]:
    """Divide the rollouts of a decoder into jobs, whose results go into a folder."""
    starts = range(FIRST_SEED, FIRST_SEED + rollouts, POLICY_ROWS)
    counts = [min(POLICY_ROWS, FIRST_SEED + rollouts - start) for start in starts]
    return [
        RollOut(trained, decoder_name, start, count, folder / f"{start}-{start + count - 1}.json")
        for start, count in zip(starts, counts, strict=True)
    ]


@dataclass(frozen=True)
class _Demos:
    """What a policy was trained on."""

    leader: Sequence[NDArray[np.float64]]  # (T, n + 1) [rad], and the gripper's opening
    elbow: ElbowReference | None


@lru_cache(maxsize=4)  # jobs of one policy follow one another
def _demos(dataset: Path, count: int | None) -> _Demos:
    info = dataset_info(dataset)
    arm = from_spec(action_spec(info["features"])).arm
    episodes = read_episodes(dataset)
    chosen = [episodes[i] for i in train_episodes(info)[:count]]
    followed = [demo.state[:, : arm.dof].astype(np.float64) for demo in chosen]
    leader = [demo.leader.astype(np.float64) for demo in chosen]
    return _Demos(leader, ElbowReference.of_demos(arm, 1 / info["fps"], followed))


def _notes(cost: Cost) -> dict[str, Any]:
    return {"cost": asdict(cost), "git": git_sha()}


def steps_of(space: str, steps: int | None, configuration: str = "") -> int:
    """Number of training steps: those asked for, or as many as the space's configuration says."""
    return default_steps(default_config(space, configuration)) if steps is None else steps
