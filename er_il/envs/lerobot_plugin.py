"""The environments as LeRobot knows them: ``--env.type=er_il --env.task=reach_cup --env.action_space=erj``."""

import sys
from dataclasses import dataclass, field
from functools import lru_cache, partial
from multiprocessing import get_context
from typing import Any

import gymnasium
from gymnasium.vector import AutoresetMode, VectorEnv
from lerobot.configs import FeatureType, PolicyFeature, parser
from lerobot.envs import EnvConfig
from lerobot.envs.utils import freeze_after_episode_end
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from er_il.arms.robot import robot_arms
from er_il.control.commander import BEST_EFFORT, check_answer
from er_il.envs.contract import check_policy
from er_il.envs.decoders import CLEAR, NEAREST, Decoder
from er_il.envs.side_by_side import BATCH_FROM, BatchDecodingEnv, ProcessesEnv, SideBySideEnv
from er_il.envs.tasks import WITHIN, takes_option, task_id
from er_il.envs.wrapper import ActionSpaceEnv, make_action_space_env
from er_il.spaces.layout import Layout
from er_il.support.errors import ErIlError

_USUAL = 20  # [Hz]


@EnvConfig.register_subclass("er_il")
@dataclass
class ErIlEnvConfig(EnvConfig):
    """A simulated task whose actions are encoded in an action space.

    Attributes:
        fps: Control rate [Hz], of the tasks here 20 or 10, as in the dataset that the policy was trained on.
        action_space: ``joint``, ``task``, ``erj``, ``era``, or ``erj@<joint>`` if ERJ commands another joint,
            ``era@stereo`` with another reference of the arm angle; with ``delta_`` in front, changes of its commands,
            with ``rel_``, its commands by a policy that sees them relative to the state.
        resolution: What IK does with the freedom that task space leaves: ``nearest``, ``posture`` or ``clear``.
        posture: Joint angles [rad] to which ``posture`` pulls; the arm's comfortable ones if empty.
        rotation: ``quat``, ``rot6d`` or ``rot6d_rows``, as in the dataset that the policy was trained on.
        arm: Name of the arm, or of a robot of several, such as ``openarm_v2``.
        on_invalid: What the arm does with an invalid action: ``best_effort``, ``hold``, ``stop``.
        cameras: Cameras that the policy sees, none for a state-based policy.
        image_size: Width and height of their images [px].
        within: Side [m] of the square in which the cup starts, of tasks that place one; the task's own range if 0.
        visualization_width: Width of the stock commands' films [px], which LeRobot holds in memory twice until all
            are written.
        visualization_height: Height of these [px].
        trust: Accept a policy whose processors import what they name (:mod:`er_il.envs.trust`).
    """

    task: str | None = "reach_cup"
    fps: int = _USUAL
    action_space: str = "erj"
    resolution: str = NEAREST
    posture: list[float] = field(default_factory=list)
    rotation: str = "quat"
    arm: str = "panda"
    on_invalid: str = BEST_EFFORT
    cameras: list[str] = field(default_factory=list)
    image_size: int = 96
    within: float = 0.0
    visualization_width: int = 320
    visualization_height: int = 240
    trust: bool = False

    def __post_init__(self) -> None:
        check_answer(self.on_invalid)
        if self.within and not takes_option(self.gym_id, WITHIN):
            raise ErIlError(f"{self.task} places no cup; leave out --env.within.")
        # An environment may know no rate but its own: it is asked for one only if it is not the usual one.
        self._rate = None if self.fps == _USUAL else self.fps
        probe = _probe(self.gym_id, self.arm, tuple(self.cameras), self.image_size, self._rate)
        self.fps = probe.fps
        action = PolicyFeature(FeatureType.ACTION, (len(self.layout.encoded_names),))
        self.features = {ACTION: action} | probe.features
        self.features_map = {ACTION: ACTION} | probe.names

    @property
    def gym_id(self) -> str:
        return task_id(self.task or "")

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        return {
            "arm": self.arm,
            "cameras": tuple(self.cameras),
            "image_size": self.image_size,
            **_asking(self._rate),
            "render_mode": "rgb_array",  # the stock commands film some episodes
            "visualization_width": self.visualization_width,
            "visualization_height": self.visualization_height,
            **({WITHIN: (self.within, self.within)} if self.within else {}),
        }

    def make(self) -> ActionSpaceEnv:
        """Make one environment."""
        return self._maker()

    @property
    def _maker(self) -> "partial[ActionSpaceEnv]":
        """Makes one environment; worker processes find :func:`_make`, and with it the tasks."""
        return partial(_make, self.gym_id, self.gym_kwargs, self.decoder, self.rotation, self.on_invalid)

    @property
    def layout(self) -> Layout:
        """The arms, each with the action space that a policy has to be trained for."""
        return self.decoder.layout_of(robot_arms(self.arm), self.rotation)

    @property
    def decoder(self) -> Decoder:
        """The decoder that the options name."""
        return Decoder(self.action_space, self.resolution, tuple(self.posture))

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv]]:
        # LeRobot's own commands tell an environment nothing about the policy it will meet, but
        # the last chance to refuse a wrong one is here.
        if policy := parser.get_path_arg("policy"):
            check_policy(policy, self.layout, self.trust)
        # An episode that has ended waits for the batch's slowest; without the freeze its successor's
        # first steps would count into its metrics.
        factories = [freeze_after_episode_end(self._maker)] * n_envs
        vector: VectorEnv
        if use_async_envs and n_envs > 1:
            # OpenGL contexts do not survive a fork, but imports do: workers begin with those of the running command,
            # where each would spend seconds and half a gigabyte on its own.
            command = [name for name in sys.modules if name.startswith("lerobot.scripts.")]
            get_context("forkserver").set_forkserver_preload([*command, __name__])
            vector = ProcessesEnv(factories, context="forkserver", autoreset_mode=AutoresetMode.NEXT_STEP)
        elif n_envs >= BATCH_FROM and self.resolution != CLEAR:  # which decodes for each environment's own world
            vector = BatchDecodingEnv(factories)
        else:
            vector = SideBySideEnv(factories, autoreset_mode=AutoresetMode.NEXT_STEP)
        return {self.type: {0: vector}}


def _make(gym_id: str, gym_kwargs: dict[str, Any], decoder: Decoder, rotation: str, on_invalid: str) -> ActionSpaceEnv:
    """Make an environment; at module level so that worker processes find it."""
    return make_action_space_env(gym_id, decoder, rotation=rotation, on_invalid=on_invalid, **gym_kwargs)


@dataclass(frozen=True)
class _Probe:
    """Properties of an environment that LeRobot needs before it makes any."""

    fps: int
    features: dict[str, PolicyFeature]  # of the observations
    names: dict[str, str]  # of these for policies


def _asking(rate: int | None) -> dict[str, Any]:
    return {} if rate is None else {"rate": rate}


@lru_cache
def _probe(gym_id: str, arm: str, cameras: tuple[str, ...], image_size: int, rate: int | None) -> _Probe:
    """Read an environment's rate and observations off one instance, once a process."""
    env = gymnasium.make(gym_id, arm=arm, cameras=cameras, image_size=image_size, **_asking(rate))
    observation = env.observation_space
    assert isinstance(observation, gymnasium.spaces.Dict)
    features, names = {}, {}
    for key, kind, name in [
        ("agent_pos", FeatureType.STATE, OBS_STATE),
        ("environment_state", FeatureType.ENV, OBS_ENV_STATE),
    ]:
        features[key] = PolicyFeature(kind, observation[key].shape or ())
        names[key] = name
    pixels = observation.spaces.get("pixels", gymnasium.spaces.Dict())
    assert isinstance(pixels, gymnasium.spaces.Dict)
    for camera, space in pixels.items():
        features[f"pixels/{camera}"] = PolicyFeature(FeatureType.VISUAL, space.shape or ())
        names[f"pixels/{camera}"] = f"{OBS_IMAGES}.{camera}"
    env.close()
    return _Probe(int(env.metadata["render_fps"]), features, names)
