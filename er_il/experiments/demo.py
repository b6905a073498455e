"""The main job in one call: demonstrations, a policy for each space, rollouts, and a report.

Every stage leaves its result in the output folder and is not done again: interrupted, the same call
goes on where it was. Training and rollouts run side by side, one thread each.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.progress import Progress

from er_il.datasets.recipe import Recipe
from er_il.datasets.recording import generate
from er_il.envs.decoders import decoder
from er_il.envs.tasks import task_id
from er_il.evaluation.results import load_cell
from er_il.evaluation.rollouts import FIRST_SEED, Cell
from er_il.experiments.jobs import RollOut, Train, roll_outs, steps_of
from er_il.experiments.schedule import Schedule
from er_il.experiments.showing import film_rollouts, telling_seed, write_report
from er_il.support.errors import ErIlError, RenderError
from er_il.support.folder_lock import sole_use
from er_il.support.workers import LocalExecutor

TASK = "reach_cup"
DECODERS = ("joint", "erj", "task-nearest", "task-posture")
ROLLOUTS = 50

INTRODUCTION = (
    "The same demonstrations of a scripted leader arm, encoded in each action space; one Action Chunking Transformer "
    "trained on each encoding, with the same settings; each policy rolled out from the same initial states, which no "
    "demonstration had. The two task decoders run the same policy: they differ in what inverse kinematics does with "
    "the elbow that a task-space action leaves open."
)


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

    def training(self, space: str) -> Train:
        """The training of a space's policy."""
        out = self.out / "policies" / self.task / space
        return Train(self.task, space, self.dataset(space), out, steps_of(space, self.steps), self.seed)

    def rolling_out(self, name: str) -> list[RollOut]:
        """The rollouts of a decoder."""
        return roll_outs(self.training(decoder(name).space), name, self.rollouts, self.out / "rollouts" / name)

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
        with sole_use(self.out):
            return self._run(progress, workers)

    def _run(self, progress: Progress, workers: int) -> list[Cell]:
        recipe = Recipe.load(self.task).replaced(seed=self.seed)
        if self.demonstrations is not None:
            recipe = recipe.resized(self.demonstrations)
        generate(recipe, self.spaces, self.out / "datasets" / self.task, progress, workers)
        # All trainings at once, be they more than the cores: in turns, a core would idle beside the last.
        with LocalExecutor(max(workers, len(self.spaces))) as executor:
            self._train_and_roll_out(executor, progress)
            cells = [Cell.joined([load_cell(job.path) for job in self.rolling_out(name)]) for name in self.decoders]
            policies = {name: self.training(decoder(name).space).training.policy for name in self.decoders}
            try:
                pictures = film_rollouts(executor, progress, policies, self.task, telling_seed(cells), self.out)
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

    def _train_and_roll_out(self, executor: LocalExecutor, progress: Progress) -> None:
        jobs = {name: self.rolling_out(name) for name in self.decoders}
        schedule = Schedule(job for name in self.decoders for job in jobs[name])
        trainings = [self.training(space) for space in self.spaces]
        training_bars = [progress.add_task(f"Train {each.space}", total=each.steps) for each in trainings]
        bars = {name: progress.add_task(f"Roll out {name}", total=self.rollouts) for name in self.decoders}

        def watch() -> None:
            for training, bar in zip(trainings, training_bars, strict=True):
                progress.update(bar, completed=training.steps if training.done else training.logged_steps)
            for name, bar in bars.items():
                progress.update(bar, completed=sum(job.count for job in jobs[name] if job in schedule.done))

        schedule.run(executor, watch)
        for message in schedule.failed.values():
            raise ErIlError(message)
