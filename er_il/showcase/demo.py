"""The main job in one call: demonstrations, a policy for each space, rollouts, and a report.

Every stage leaves its result in the output folder and is not done again: interrupted, the same call
goes on where it was. Training and rollouts run side by side, one thread each.
"""

import json
import os
import re
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from rich.progress import Progress, TaskID

from er_il.data.recipe import Recipe
from er_il.data.recording import generate
from er_il.errors import ErIlError, RenderError
from er_il.policy.actor import POLICY_ROWS
from er_il.policy.decoders import decoder
from er_il.policy.evaluation import FIRST_SEED, Cell, evaluate
from er_il.policy.results import load_cell, save_cell
from er_il.policy.training import Training, default_config, default_steps
from er_il.showcase.showing import film_rollouts, telling_seed, write_report
from er_il.tasks import task_id
from er_il.workers import worker_pool

TASK = "reach_cup"
DECODERS = ("joint", "erj", "task-nearest", "task-posture")
ROLLOUTS = 50
POLL = 0.5  # [s] between looks at the trainings' logs

INTRODUCTION = (
    "The same demonstrations of a scripted leader arm, encoded in each action space; one Action Chunking Transformer "
    "trained on each encoding, with the same settings; each policy rolled out from the same initial states, which no "
    "demonstration had. The two task decoders run the same policy: they differ in what inverse kinematics does with "
    "the elbow that a task-space action leaves open."
)

_LOGGED_STEP = re.compile(r"step:([\d.]+)(K?)")  # as lerobot-train logs it


@dataclass(frozen=True)
class Demo:
    """One run of the demo, in a folder that belongs to one seed and one set of decoders."""

    out: Path
    seed: int = 0
    task: str = TASK
    decoders: tuple[str, ...] = DECODERS
    rollouts: int = ROLLOUTS  # a decoder
    demonstrations: int | None = None  # as many as the recipe says if None
    steps: int | None = None  # of training a policy; as many as the configuration says if None

    def __post_init__(self) -> None:
        task_id(self.task)
        for name in self.decoders:
            decoder(name)  # raises if unknown
        if self.rollouts < 1:
            raise ErIlError(f"{self.rollouts} rollouts say nothing; ask for at least one.")

    @property
    def spaces(self) -> tuple[str, ...]:
        """The action spaces that the decoders read, each once."""
        return tuple(dict.fromkeys(decoder(name).space for name in self.decoders))

    def dataset(self, space: str) -> Path:
        """Folder of a space's dataset."""
        return self.out / "datasets" / self.task / space

    def training(self, space: str) -> Training:
        """The training of a space's policy."""
        config = default_config(space)
        return Training(
            task=self.task,
            space=space,
            dataset=self.dataset(space),
            out=self.out / "policies" / self.task / space,
            config=config,
            steps=self.steps or default_steps(config),
            seed=self.seed,
        )

    def claim(self) -> None:
        """Make the folder this run's own.

        Raises:
            ErIlError: it holds another run's results.
        """
        owner = self.out / "demo.json"
        mine = {key: value for key, value in asdict(self).items() if key != "out"}
        if owner.exists():
            found = json.loads(owner.read_text())
            if different := [key for key, value in mine.items() if found.get(key) != json.loads(json.dumps(value))]:
                difference = ", ".join(f"{key} {found.get(key)!r}, not {mine[key]!r}" for key in different)
                raise ErIlError(f"{self.out} holds a demo with {difference}; choose another --out, or delete it.")
            return
        if self.out.exists() and any(self.out.iterdir()):
            raise ErIlError(f"{self.out} holds something else than a demo; choose another --out.")
        self.out.mkdir(parents=True, exist_ok=True)
        owner.write_text(json.dumps(mine))

    def run(self, progress: Progress, workers: int) -> list[Cell]:
        """Do all that is not done yet, write the report; return a cell a decoder."""
        self.claim()
        recipe = replace(Recipe.load(self.task), seed=self.seed)
        if self.demonstrations is not None:
            recipe = recipe.resized(self.demonstrations)
        generate(recipe, self.spaces, self.out / "datasets" / self.task, progress, workers)
        # All trainings at once, be they more than the cores: in turns, a core would idle beside the last.
        with worker_pool(max(workers, len(self.spaces)), _one_thread) as pool:
            _Schedule(self, pool, progress).run()
            cells = [self._cell(name) for name in self.decoders]
            policies = {name: self.training(decoder(name).space).policy for name in self.decoders}
            try:
                pictures = film_rollouts(pool, progress, policies, self.task, telling_seed(cells), self.out)
            except RenderError as error:
                progress.console.print(f"No films and pictures: {error}", highlight=False)
                pictures = {}
        meta = {
            "demonstrations": recipe.episodes,
            "trained_on": recipe.episodes - recipe.validation,
            "demonstration_and_training_seed": self.seed,
            "training_steps": self.training(self.spaces[0]).steps,
            "rollouts": self.rollouts,
            "rollout_seeds": f"{FIRST_SEED} to {FIRST_SEED + self.rollouts - 1}",
        }
        write_report(cells, meta, self.out, INTRODUCTION, pictures)
        return cells

    def chunks(self, name: str) -> list[tuple[Path, int, int]]:
        """The rollouts of a decoder in jobs: where the result goes, the first seed, how many."""
        folder = self.out / "rollouts"
        return [
            (folder / f"{name}-{start}.json", FIRST_SEED + start, min(POLICY_ROWS, self.rollouts - start))
            for start in range(0, self.rollouts, POLICY_ROWS)
        ]

    def _cell(self, name: str) -> Cell:
        cells = [load_cell(path) for path, _, _ in self.chunks(name)]
        return Cell(self.task, name, tuple(episode for cell in cells for episode in cell.episodes))


class _Schedule:
    """Runs trainings first; as soon as a policy is there, its rollouts."""

    def __init__(self, demo: Demo, pool: ProcessPoolExecutor, progress: Progress) -> None:
        self._demo, self._pool, self._progress = demo, pool, progress
        self._trainings: dict[Future[None], tuple[Training, TaskID]] = {}
        self._rollouts: dict[Future[None], tuple[TaskID, int]] = {}
        self._bars = {name: progress.add_task(f"Roll out {name}", total=demo.rollouts) for name in demo.decoders}

    def run(self) -> None:
        for space in self._demo.spaces:
            training = self._demo.training(space)
            bar = self._progress.add_task(f"Train {space}", total=training.steps)
            self._trainings[self._pool.submit(_train, training)] = training, bar
        while self._trainings or self._rollouts:
            done, _ = wait([*self._trainings, *self._rollouts], timeout=POLL, return_when=FIRST_COMPLETED)
            for future in done:
                future.result()  # raises what the job raised
                if future in self._trainings:
                    training, bar = self._trainings.pop(future)
                    self._progress.update(bar, completed=training.steps)
                    self._roll_out(training)
                else:
                    bar, count = self._rollouts.pop(future)
                    self._progress.advance(bar, count)
            for training, bar in self._trainings.values():
                self._progress.update(bar, completed=_logged_steps(training))

    def _roll_out(self, training: Training) -> None:
        for name in self._demo.decoders:
            if decoder(name).space == training.space:
                for path, seed, count in self._demo.chunks(name):
                    job = self._pool.submit(_evaluate, training.policy, self._demo.task, name, seed, count, path)
                    self._rollouts[job] = self._bars[name], count


def _one_thread() -> None:
    # More threads than cores make the small matrices of these policies ten times slower.
    os.environ["OMP_NUM_THREADS"] = "1"


def _train(training: Training) -> None:
    if training.finished:
        return
    log = _log(training)
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w") as file:
        code = training.run(file)
    if code:
        raise ErIlError(f"The training of {training.space} failed; see {log}.")


def _evaluate(policy: Path, task: str, name: str, seed: int, count: int, path: Path) -> None:
    if not path.exists():
        save_cell(evaluate(policy, task, name, episodes=count, seed=seed), path)


def _log(training: Training) -> Path:
    return training.out.with_name(f"{training.space}.log")


def _logged_steps(training: Training) -> int:
    """Number of steps that a running training has reported."""
    try:
        steps = _LOGGED_STEP.findall(_log(training).read_text())
    except OSError:
        return 0
    return int(float(steps[-1][0]) * (1000 if steps[-1][1] else 1)) if steps else 0
