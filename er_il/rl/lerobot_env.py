"""The environments of agents as LeRobot knows them: ``--env.type=er_il_rl --env.task=reach_target --env.mode=erj``."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import gymnasium
from gymnasium.vector import AutoresetMode, VectorEnv
from lerobot.configs import FeatureType, PolicyFeature, parser
from lerobot.envs import EnvConfig
from lerobot.envs.utils import freeze_after_episode_end
from lerobot.utils.constants import ACTION, OBS_IMAGES, OBS_STATE

from er_il.envs.contract import read_policy_config
from er_il.envs.learning import CAMERAS, DECISIONS, IMAGE_SIZE, PIXELS, RATE, STATE, LearningEnv, make_rl_env
from er_il.envs.side_by_side import ProcessesEnv, SideBySideEnv
from er_il.rl.modes import mode_of_environment
from er_il.support.errors import PolicyError

AGENT_POS = "agent_pos"  # the key by which LeRobot finds a state


@EnvConfig.register_subclass("er_il_rl")
@dataclass
class LearningEnvConfig(EnvConfig):
    """A task as an agent learnt it: delta actions in [-1, 1], decided at 10 Hz.

    Attributes:
        mode: The action mode, see :mod:`er_il.rl.modes`.
        arm: The arm that does the task.
        pixels: Observe the cameras wrist and front instead of the objects' places.
    """

    task: str | None = "reach_target"
    fps: int = RATE
    mode: str = "erj"
    arm: str = "panda"
    pixels: bool = False

    def __post_init__(self) -> None:
        probe = self.make()
        state = PolicyFeature(FeatureType.STATE, (len(probe.unwrapped.observation_names),))
        action = PolicyFeature(FeatureType.ACTION, (len(probe.unwrapped.action_names),))
        probe.close()
        image = PolicyFeature(FeatureType.VISUAL, (IMAGE_SIZE, IMAGE_SIZE, 3))
        images = {f"{PIXELS}/{camera}": image for camera in CAMERAS} if self.pixels else {}
        self.features = {ACTION: action, AGENT_POS: state, **images}
        names = {key: f"{OBS_IMAGES}.{key.partition('/')[2]}" for key in images}
        self.features_map = {ACTION: ACTION, AGENT_POS: OBS_STATE, **names}

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        return {"pixels": self.pixels, "arm": self.arm, "render_mode": "rgb_array"}

    def make(self) -> "LeRobotObservations":
        """Make one environment."""
        return self._maker()

    @property
    def _maker(self) -> "partial[LeRobotObservations]":
        return partial(_make, self.task or "", mode_of_environment(self.mode), self.gym_kwargs)

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv]]:
        if policy := parser.get_path_arg("policy"):
            self._check(policy)
        factories = [freeze_after_episode_end(self._maker)] * n_envs
        vector: VectorEnv
        if use_async_envs and n_envs > 1:  # OpenGL contexts do not survive a fork
            vector = ProcessesEnv(factories, context="forkserver", autoreset_mode=AutoresetMode.NEXT_STEP)
        else:
            vector = SideBySideEnv(factories, autoreset_mode=AutoresetMode.NEXT_STEP)
        return {self.type: {0: vector}}

    def _check(self, policy: str) -> None:
        """Refuse an agent that learnt in another mode, or with another arm."""
        config = read_policy_config(policy)
        for key, asked in (("mode", self.mode), ("arm", self.arm)):
            if (learnt := config.get(key)) != asked:
                raise PolicyError(f"The agent {policy} learnt with the {key} {learnt}: --env.{key}={learnt}.")


class LeRobotObservations(gymnasium.ObservationWrapper[Any, Any, Any]):
    """An agent's environment whose observations are named as LeRobot reads them."""

    def __init__(self, env: LearningEnv) -> None:
        super().__init__(env)
        self.task_description, self.task = env.world.task_description, env.task
        self._max_episode_steps = DECISIONS  # LeRobot asks for it
        space = env.observation_space
        self.observation_space = gymnasium.spaces.Dict(
            {
                AGENT_POS: space[STATE],
                PIXELS: gymnasium.spaces.Dict({camera: space[camera] for camera in CAMERAS}),
            }
            if isinstance(space, gymnasium.spaces.Dict)
            else {AGENT_POS: space}
        )

    @property
    def unwrapped(self) -> LearningEnv:
        env = super().unwrapped
        assert isinstance(env, LearningEnv)
        return env

    def observation(self, observation: Any) -> dict[str, Any]:
        if not isinstance(observation, dict):
            return {AGENT_POS: observation}
        return {AGENT_POS: observation[STATE], PIXELS: {camera: observation[camera] for camera in CAMERAS}}


def _make(task: str, mode: str, settings: dict[str, Any]) -> LeRobotObservations:
    """Make an environment; at module level so that worker processes find it."""
    return LeRobotObservations(make_rl_env(task, mode, **settings))
