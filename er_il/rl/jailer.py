"""JAiLeR (Kumar et al. 2021, paper V-A): a task policy acts through a controller that learns at the same time.

The paper leaves open how goals are given, how often, and from where they count. Here a goal is a change of the measured
pose, in the units of the action mode ``task``, and the controller answers it with one change of the joints, as in the
mode ``joint``: each decision is one of both.
"""

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv, VecEnvWrapper

from er_il.envs.learning import STATE
from er_il.rl.controller import GOAL_NAMES, TASK_SHARE, ControllerView
from er_il.rl.learner import make_sac
from er_il.rl.settings import Settings

Floats = NDArray[np.float32]


class Jailer(VecEnvWrapper):
    """Environments in joint space as a task policy sees them: actions are changes of the pose, and the gripper.

    Every step is one of the controller, too: it acts, keeps the transition, and learns. Its next observation holds the
    goal that comes next, once the task policy has said it; at an episode's end, what was left of the last one.
    """

    def __init__(self, envs: VecEnv, names: tuple[str, ...], settings: Settings, seed: int, rewarded: bool) -> None:
        """Wrap environments of the mode ``joint``.

        Args:
            envs: The environments.
            names: Of the state's dimensions.
            settings: How the controller learns: as the task policy does.
            seed: Of the controller.
            rewarded: Reward the controller with a share of the task's reward, too: JAiLeR (+rew).
        """
        actions = gymnasium.spaces.Box(-1.0, 1.0, (len(GOAL_NAMES) + 1,), np.float32)
        super().__init__(envs, action_space=actions)
        self._view, self._settings, self._rewarded = ControllerView(names), settings, rewarded
        self.controller = make_sac(_Blank.side_by_side(envs, self._view), self._view.inputs, settings, seed)
        self._states: Floats = np.empty(0, np.float32)  # (N, s) of now
        self._goals: tuple[NDArray[np.float64], Rotation] | None = None
        self._waiting: _Transitions | None = None  # until the next goals are known
        self._seen: Floats = np.empty(0, np.float32)  # (N, c) what the controller saw of the decision under way
        self._chosen: Floats = np.empty(0, np.float32)  # (N, n) and what it did

    def reset(self) -> Any:
        observations = self.venv.reset()
        self._states, self._waiting = _states(observations), None
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        controller = self.controller
        self._seen = self._view.observe(self._states, actions)
        self._goals = self._view.goals(self._states, actions)
        if self._waiting is not None:
            self._keep(self._waiting)
            if controller.num_timesteps > self._settings.warm_up:
                controller.train(self._settings.updates, self._settings.batch_size)
        controller.policy.set_training_mode(False)
        controller._last_obs = self._seen
        self._chosen, _ = controller._sample_action(self._settings.warm_up, n_envs=self.num_envs)
        self.venv.step_async(np.hstack([self._chosen, actions[:, -1:]]))

    def step_wait(self) -> Any:
        assert self._goals is not None, "A step begins with step_async."
        observations, rewards, dones, infos = self.venv.step_wait()
        states = _states(observations)
        reached = states.copy()
        for row in np.flatnonzero(dones):
            reached[row] = _states(infos[row]["terminal_observation"])
        earned = self._view.rewards(self._states, reached, self._goals)
        if self._rewarded:
            earned += TASK_SHARE * rewards
        left = self._view.shares(self._view.errors(reached, self._goals))
        earned *= self._settings.reward_scale
        afterwards = self._view.observe(reached, left)
        self._waiting = _Transitions(self._seen, self._chosen, earned, dones, infos, afterwards)
        self.controller.num_timesteps += self.num_envs
        self._states = states
        return observations, rewards, dones, infos

    def _keep(self, waiting: "_Transitions") -> None:
        """Store transitions, now that the goals are known which follow them."""
        goes_on = ~waiting.dones
        waiting.afterwards[goes_on] = self._seen[goes_on]
        assert self.controller.replay_buffer is not None
        self.controller.replay_buffer.add(
            waiting.seen, waiting.afterwards, waiting.chosen, waiting.rewards, waiting.dones, waiting.infos
        )


def _states(observations: Any) -> Floats:
    """The states (N, s), which with images are a part of the observations."""
    return observations[STATE] if isinstance(observations, dict) else observations


@dataclass(frozen=True, eq=False)
class _Transitions:
    """Of the controller, in all environments."""

    seen: Floats
    chosen: Floats
    rewards: NDArray[np.float64]
    dones: NDArray[np.bool_]
    infos: list[dict[str, Any]]
    afterwards: Floats  # completed in place once the next goals are known


class _Blank(gymnasium.Env[Floats, Floats]):
    """An environment that is not there: SAC is told the controller's spaces by one."""

    def __init__(self, observations: int, actions: int) -> None:
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (observations,), np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (actions,), np.float32)

    @classmethod
    def side_by_side(cls, envs: VecEnv, view: ControllerView) -> DummyVecEnv:
        """As many as ``envs``, for the controller of these."""
        assert envs.action_space.shape is not None
        joints = envs.action_space.shape[0] - 1
        return DummyVecEnv([lambda: cls(len(view.inputs), joints)] * envs.num_envs)
