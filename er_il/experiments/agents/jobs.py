"""The jobs of an experiment with agents: training them, assessing them, filming them; each leaves files."""

import shutil
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_il.evaluation.rollout import FIRST_SEED
from er_il.experiments.cell_plan import RolloutJob, TrainingJob
from er_il.experiments.schedule import Job, notes
from er_il.rl.milestones import read_milestones
from er_il.rl.settings import Settings
from er_il.support.atomic_files import write_json
from er_il.support.cost import measured
from er_il.support.errors import PolicyError

if TYPE_CHECKING:
    from er_il.rl.training import AgentTraining


@dataclass(frozen=True)
class TrainAgent(TrainingJob):
    """Train an agent, ``size`` decisions, or go on where that was interrupted.

    The result is notes (JSON) on the way there; the training is in the folder of that name beside.
    """

    task: str
    mode: str
    arm: str
    environment: Mapping[str, Any] = field(hash=False)  # settings of the task
    settings: Settings = field(hash=False)

    stage = "Learn"

    @property
    def training(self) -> "AgentTraining":
        """The training."""
        from er_il.rl.training import AgentTraining  # Stable-Baselines3: seconds that mistakes do without

        return AgentTraining(
            self.task,
            self.mode,
            self.size,
            self.seed,
            self.settings,
            self.path.with_suffix(""),
            self.arm,
            environment=self.environment,
        )

    @property
    def progress(self) -> int:  # pyrefly: ignore[bad-override]
        try:
            return read_milestones(self.path.with_suffix(""))[-1].steps
        except (PolicyError, IndexError):
            return 0  # none is there yet

    def run(self) -> None:
        from er_il.rl.checkpoint import STATE, last_checkpoint

        with measured() as cost:
            milestones = self.training.run()
        write_json(self.path, notes(cost) | {"milestones": [vars(each) for each in milestones]})
        last = last_checkpoint(self.path.with_suffix(""))
        assert last is not None
        shutil.rmtree(last / STATE)  # a hundred megabytes of transitions, from which nothing goes on any more


@dataclass(frozen=True)
class AssessAgent(RolloutJob):
    """Roll a trained agent out without exploration, from ``size`` starts that are the same for all."""

    needs: tuple[TrainAgent]

    stage = "Assess"

    def run(self) -> None:
        from er_il.evaluation.results import save_rollouts
        from er_il.policy.actor import one_thread
        from er_il.rl.evaluation import roll_out
        from er_il.rl.loading import load_agent

        training = self.needs[0].training
        agent = load_agent(training.out)
        with measured() as cost, one_thread(), closing(training.make_env()) as env:
            rollouts = roll_out(agent.act, env, range(FIRST_SEED, FIRST_SEED + self.size))
        save_rollouts(rollouts, self.path, notes(cost))


@dataclass(frozen=True)
class FilmAgent(Job):
    """Record one episode of a trained agent: as a film (.mp4), a Rerun recording (.rrd) and a trace (.npz, last)."""

    needs: tuple[TrainAgent]
    seed: int  # of the start

    stage = "Film"

    @property
    def film(self) -> Path:
        """The film."""
        return self.path.with_suffix(".mp4")

    def run(self) -> None:
        from er_il.policy.actor import one_thread
        from er_il.rl.loading import load_agent
        from er_il.rl.recording import film_episode

        training = self.needs[0].training
        agent = load_agent(training.out)
        with one_thread(), closing(training.make_env(render_mode="rgb_array")) as env:
            film_episode(agent.act, env, training.task, training.mode, self.seed, self.film)
