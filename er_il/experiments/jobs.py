"""The jobs of an experiment: recording demonstrations, training policies, rolling out, filming; each leaves files."""

import os
import re
import shutil
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import read_episodes
from er_il.datasets.recording import generate
from er_il.evaluation.elbow import ElbowReference
from er_il.evaluation.posture_baselines import POSTURE_BASELINES, POSTURE_DECODER
from er_il.experiments.cell_plan import RolloutJob, TrainingJob
from er_il.experiments.schedule import Job, notes
from er_il.kinematics.rotation import Quaternion
from er_il.policy.configuration import default_config
from er_il.policy.training import PRECISION, Training, train_episodes
from er_il.support.atomic_files import atomic_folder, write_json
from er_il.support.cost import measured
from er_il.support.errors import ErIlError

Array = NDArray[np.float64]

FILM_EVERY = 2  # control steps a picture: shadows make each expensive
_LOGGED_STEP = re.compile(r"step:([\d.]+)(K?)")  # as lerobot-train logs it


@dataclass(frozen=True)
class Demonstrate(Job):
    """Record the demonstrations of a recipe, once, and encode them in each space: a folder of datasets, one a space."""

    recipe: Recipe = field(hash=False)
    spaces: tuple[str, ...]
    workers: int  # processes that record

    stage = "Record"

    @property
    def done(self) -> bool:
        return all((self.path / space).exists() for space in self.spaces)

    def run(self) -> None:
        generate(self.recipe, self.spaces, self.path, Progress(disable=True), self.workers)

    def dataset(self, space: str) -> Path:
        """The dataset of a space."""
        return self.path / space


@dataclass(frozen=True)
class DeriveDataset(Job):
    """Make a dataset of one space out of the demonstrations, or of another one that is made out of them."""

    needs: "tuple[Demonstrate | DeriveDataset]"
    space: str

    @property
    def recipe(self) -> Recipe:
        """Recipe of the demonstrations."""
        return self.needs[0].recipe

    def dataset(self, space: str) -> Path:
        """The dataset, which is of one space only."""
        return self.path


@dataclass(frozen=True)
class FitWeights(DeriveDataset):
    """Fit ERX's weights to the demonstrations that a policy is trained on, and to these alone: a dataset in ERX, or in
    its chunk-relative form.

    The others are encoded by the same weights.
    """

    needs: tuple[Demonstrate]
    demonstrations: int  # the first ones of the training episodes

    stage = "Fit"

    def run(self) -> None:
        from lerobot.utils.utils import SuppressProgressBars

        from er_il.datasets.encoding import encode_dataset
        from er_il.spaces.margin import demonstrated_weights

        (demonstrated,) = self.needs
        source = Dataset(demonstrated.dataset(demonstrated.spaces[0]))
        leader, _ = _training_paths(source.root, self.demonstrations)
        known = source.layout
        weights = {
            part.label: demonstrated_weights(part.space.arm, [known.angles(part, path) for path in leader])
            for part in known.parts
        }
        with SuppressProgressBars():
            encode_dataset(source, self.path, known.in_space(self.space, Quaternion.kind, weights))


@dataclass(frozen=True)
class HideJoints(DeriveDataset):
    """Make a dataset of a space whose policies do not see the arm's joints."""

    stage = "Hide joints"

    def run(self) -> None:
        from er_il.datasets.normalisation import hide_joints

        with atomic_folder(self.path) as partial:
            shutil.copytree(self.needs[0].dataset(self.space), partial)
            hide_joints(partial)


@dataclass(frozen=True)
class Train(TrainingJob):
    """Train the policy of a space, ``size`` steps, with LeRobot's own command, or go on where that was interrupted.

    The result is notes (JSON) on the policy's cost and origin; the training is in the folder of that name beside.
    """

    needs: tuple[Demonstrate | DeriveDataset]
    space: str
    demonstrations: int  # the first ones of the training episodes
    configuration: str  # kind of the shipped one, such as images_small; from states if empty

    stage = "Train"

    @property
    def training(self) -> Training:
        """The training; the dataset must be there."""
        (source,) = self.needs
        task, dataset = source.recipe.task, source.dataset(self.space)
        out, config = self.path.with_suffix(""), default_config(self.space, self.configuration)
        return Training(task, self.space, dataset, out, config, self.size, self.seed, self.demonstrations)

    @property
    def progress(self) -> int:  # pyrefly: ignore[bad-override]
        logged = _LOGGED_STEP.findall(self.log.read_text()) if self.log.exists() else []
        return int(float(logged[-1][0]) * (1000 if logged[-1][1] else 1)) if logged else 0

    def run(self) -> None:
        training = self.training
        self.log.parent.mkdir(parents=True, exist_ok=True)
        with measured() as cost:
            if not training.finished:
                with self.log.open("w") as file:
                    code = training.run(file)
                if code:
                    raise ErIlError(f"lerobot-train ended with exit code {code}.")
        write_json(self.path, notes(cost) | {"mixed_precision": os.environ.get(PRECISION, "no")})


@dataclass(frozen=True)
class RollOut(RolloutJob):
    """Roll a trained policy out through a decoder, on ``size`` initial states."""

    needs: tuple[Train]
    decoder: str  # a decoder, or a posture baseline
    first_seed: int  # of the initial states
    within: float | None = None  # [m] see Cell

    stage = "Roll out"

    def run(self) -> None:
        from er_il.evaluation.results import save_rollouts
        from er_il.evaluation.rollouts import evaluate

        training = self.needs[0].training
        leader, elbow = _demonstrated(training)
        posture = POSTURE_BASELINES.get(self.decoder)
        with measured() as cost:
            rollouts = evaluate(
                training.policy,
                training.task,
                POSTURE_DECODER if posture else self.decoder,
                episodes=self.size,
                seed=self.first_seed,
                posture=posture(leader).tolist() if posture else (),
                elbow=elbow,
                within=self.within,
            )
        save_rollouts(rollouts, self.path, notes(cost))


@dataclass(frozen=True)
class Film(Job):
    """Record one rollout of a trained policy: as a film (.mp4), a Rerun recording (.rrd) and a trace (.npz, last)."""

    needs: tuple[Train]
    decoder: str
    seed: int  # of the initial state
    within: float | None = None  # [m] see Cell

    stage = "Film"

    @property
    def files(self) -> tuple[Path, Path, Path]:
        """The film, the recording and the trace."""
        return self.path.with_suffix(".mp4"), self.path.with_suffix(".rrd"), self.path

    def run(self) -> None:
        from er_il.evaluation.recording import record_rollout
        from er_il.report.films import write_film
        from er_il.viewer.show import save_rollout

        training, (film, recording, path) = self.needs[0].training, self.files
        shown = training.policy, training.task, self.decoder, self.seed, FILM_EVERY, self.within
        trace, pictures = record_rollout(*shown)
        write_film(pictures, film, round(1 / trace.period / FILM_EVERY))
        save_rollout(trace, recording)
        trace.save(path)


@lru_cache(maxsize=4)  # jobs of one policy follow one another
def _demonstrated(training: Training) -> tuple[list[Array], ElbowReference | None]:
    """The leader's paths (T, n + 1) [rad and opening] that a policy was trained on, and where the elbow was.

    The elbows of several arms are measured against nothing.
    """
    dataset = Dataset(training.dataset)
    leader, state = _training_paths(training.dataset, training.demonstrations)
    arm, *others = [part.space.arm for part in dataset.layout.parts]
    if others:
        return leader, None
    return leader, ElbowReference.of_demos(arm, 1 / dataset.info["fps"], [path[:, : arm.dof] for path in state])


def _training_paths(dataset: Path, demonstrations: int | None) -> tuple[list[Array], list[Array]]:
    """The leader's joint vectors (T, D) [rad and openings] and the states (T, s) in the first training episodes."""
    episodes = read_episodes(dataset)
    chosen = [episodes[i] for i in train_episodes(Dataset(dataset).info)[:demonstrations]]
    return [demo.leader.astype(np.float64) for demo in chosen], [demo.state.astype(np.float64) for demo in chosen]
