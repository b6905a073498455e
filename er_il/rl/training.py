"""The training of an agent by Stable-Baselines3's SAC, in checkpoints, from the last of which it goes on.

Interrupted or not, it gives the same agent, number by number.
"""

from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.wrappers import TimeLimit
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper, VecMonitor

from er_il.envs.learning import LearningEnv, make_rl_env
from er_il.evaluation.rollout import FIRST_SEED, Rollout
from er_il.policy.actor import one_thread
from er_il.rl.checkpoint import POLICY, STATE, last_checkpoint, load_state, save_state, write_checkpoint
from er_il.rl.evaluation import roll_out
from er_il.rl.export import make_policy, save_policy
from er_il.rl.jailer import Jailer
from er_il.rl.learner import aim, end_episodes, make_sac, unchecked_distributions
from er_il.rl.milestones import Milestone, read_milestones, write_milestones
from er_il.rl.modes import JAILER_REWARDED, has_controller, mode_of_environment
from er_il.rl.settings import Settings
from er_il.support.atomic_files import work_folder, write_json
from er_il.support.errors import PolicyError
from er_il.support.json_files import read_json
from er_il.support.provenance import provenance

TRAINING = "training.json"  # what was asked for
TENSORBOARD = "tensorboard"
_SEEDS = 100_000_000  # of starts to learn from: above those of demonstrations and evaluations
_SEEDS_PER_TRAINING, _SEEDS_PER_START = 100_000, 100  # between two milestones, one an environment


@dataclass(frozen=True)
class AgentTraining:
    """What is to be learnt, and where it is kept.

    The folder holds what was asked for, the evaluations so far (``learning.json``), TensorBoard's logs and the last
    checkpoint, with the agent as a LeRobot policy.
    """

    task: str
    mode: str
    steps: int  # decisions
    seed: int
    settings: Settings
    out: Path
    arm: str = "panda"
    pixels: bool = False
    environment: Mapping[str, Any] = field(default_factory=dict)  # other settings of the task

    def run(self, advance: Callable[[int, str], None] = lambda steps, text: None) -> list[Milestone]:
        """Train, or go on where an interruption was; return all evaluations.

        Args:
            advance: Told the decisions so far, and what the last evaluation was.

        Raises:
            PolicyError: another training is in the folder, or it is damaged.
            ErIlError: another process trains there, or the task, mode or arm is unknown.
        """
        has_controller(self.mode)  # raises if unknown
        with work_folder(self.out), one_thread(), unchecked_distributions(), ExitStack() as stack:
            self._claim()
            probe = stack.enter_context(closing(self.make_env()))
            if self.finished:
                return self.milestones
            envs = DummyVecEnv([self._make_lessons] * self.settings.environments)
            stack.enter_context(closing(envs))
            return _Run(self, probe, envs, advance).learn()

    def make_env(self, **more: Any) -> LearningEnv:
        """An environment of its task and mode; with more settings if wanted (:class:`LearningEnv`)."""
        mode = mode_of_environment(self.mode)
        return make_rl_env(self.task, mode, pixels=self.pixels, arm=self.arm, **self.environment, **more)

    def _make_lessons(self) -> gymnasium.Env[Any, Any]:
        return TimeLimit(self.make_env(), self.settings.episode)

    @property
    def finished(self) -> bool:
        """True if it has learnt from so many decisions."""
        last = last_checkpoint(self.out)
        return last is not None and int(last.name) >= self.steps

    @property
    def milestones(self) -> list[Milestone]:
        """The evaluations up to the last checkpoint (:func:`er_il.rl.milestones.read_milestones`)."""
        return read_milestones(self.out)

    @cached_property
    def _asked(self) -> dict[str, Any]:
        """What decides the agent, but the number of steps, to which more can be added."""
        return {
            "task": self.task,
            "mode": self.mode,
            "arm": self.arm,
            "seed": self.seed,
            "pixels": self.pixels,
            "environment": dict(self.environment),
            "settings": self.settings.to_dict(),
        }

    def _claim(self) -> None:
        """Make the folder this training's own."""
        path = self.out / TRAINING
        if not path.exists():
            if self.out.exists() and any(self.out.iterdir()):
                raise PolicyError(f"{self.out} holds something else than an agent; choose another --out.")
            write_json(path, {"asked": self._asked, "meta": provenance()})
            return
        found = read_json(path, PolicyError).get("asked")
        found = found if isinstance(found, dict) else {}
        if different := [key for key, value in self._asked.items() if found.get(key) != value]:
            ours, theirs = ({key: each.get(key) for key in different} for each in (self._asked, found))
            raise PolicyError(
                f"{self.out} holds another training; asked for is {ours} instead of {theirs}. Choose another --out."
            )


class _Run(BaseCallback):
    """A training while it runs."""

    def __init__(
        self, training: AgentTraining, probe: LearningEnv, envs: VecEnv, advance: Callable[[int, str], None]
    ) -> None:
        super().__init__()
        self._training, self._probe, self._advance = training, probe, advance
        settings, seed, logs = training.settings, training.seed, training.out / TENSORBOARD
        self._controller: SAC | None = None
        outer: VecEnv = envs
        if has_controller(training.mode):
            rewarded = training.mode == JAILER_REWARDED
            outer = jailer = Jailer(envs, probe.observation_names, settings, seed, rewarded)
            self._controller = jailer.controller
            self._controller.set_logger(configure(str(logs / "controller"), ["tensorboard"]))
        self._sac = make_sac(_Scaled(VecMonitor(outer), settings.reward_scale), probe.observation_names, settings, seed)
        self._sac.set_logger(configure(str(logs), ["tensorboard"]))
        self._milestones: list[Milestone] = []
        self._invalid = self._decisions = 0  # since the last milestone
        if (last := last_checkpoint(training.out)) is not None:
            progress = load_state(last / STATE, self._learners)
            self._milestones = [Milestone(**each) for each in progress["milestones"]]
        self._seed_starts()

    @property
    def _learners(self) -> dict[str, SAC]:
        return {"task": self._sac} | ({"controller": self._controller} if self._controller else {})

    def _seed_starts(self) -> None:
        training, number = self._training, len(self._milestones)
        self._environments.seed(_SEEDS + training.seed * _SEEDS_PER_TRAINING + number * _SEEDS_PER_START)

    @property
    def _environments(self) -> VecEnv:
        assert self._sac.env is not None
        return self._sac.env

    def learn(self) -> list[Milestone]:
        """Learn to the end."""
        left = self._training.steps - self._sac.num_timesteps
        self._sac.learn(left, self, log_interval=10, reset_num_timesteps=False)
        return self._milestones

    def _on_step(self) -> bool:
        infos = self.locals["infos"]
        self._invalid += sum(info["invalid"] for info in infos)
        self._decisions += len(infos)
        self._tell()
        return True

    def _on_rollout_start(self) -> None:  # between an update and the next decision: nothing is half done
        every = self._training.settings.milestone
        if self.num_timesteps // every > (self._milestones[-1].steps // every if self._milestones else 0):
            self._pause()
            # New episodes, as after an interruption here: whether there was one makes no difference.
            self._seed_starts()
            self._sac._last_obs = self._environments.reset()
        for learner in self._learners.values():
            aim(learner, self._training.settings, self.num_timesteps / self._training.steps)

    def _on_training_end(self) -> None:
        if not self._milestones or self._milestones[-1].steps < self.num_timesteps:
            self._pause()

    def _pause(self) -> None:
        """Evaluate, and write a checkpoint."""
        training, steps = self._training, self.num_timesteps
        for learner in self._learners.values():
            end_episodes(learner)  # what goes on here begins new ones
        policy = make_policy(self._probe, training, self._learners)
        seeds = range(FIRST_SEED, FIRST_SEED + training.settings.evaluations)
        done = roll_out(policy.act, self._probe, seeds)
        self._keep(done, steps)
        progress = {"milestones": [vars(each) for each in self._milestones]}

        def write(folder: Path) -> None:
            save_state(folder / STATE, self._learners, progress)
            save_policy(policy, folder / POLICY)

        write_checkpoint(training.out, steps, write)
        write_milestones(training.out, self._milestones)
        self._tell()

    def _keep(self, done: list[Rollout], steps: int) -> None:
        successes, rate = sum(each.success for each in done), self._invalid / max(self._decisions, 1)
        self._milestones.append(Milestone(steps, successes, len(done), rate))
        self._invalid = self._decisions = 0
        self.logger.record("evaluation/success", successes / len(done))
        self.logger.record("rollout/invalid", rate)
        self.logger.dump(steps)
        if self._controller:
            self._controller.logger.dump(steps)

    def _tell(self) -> None:
        last = self._milestones[-1] if self._milestones else None
        text = f"{last.successes}/{last.episodes} after {last.steps:,}" if last else ""
        self._advance(self.num_timesteps, text)


class _Scaled(VecEnvWrapper):
    """Environments whose rewards are multiplied."""

    def __init__(self, envs: VecEnv, scale: float) -> None:
        super().__init__(envs)
        self._scale = scale

    def reset(self) -> Any:
        return self.venv.reset()

    def step_wait(self) -> Any:
        observations, rewards, dones, infos = self.venv.step_wait()
        return observations, rewards * self._scale, dones, infos
