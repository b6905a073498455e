"""The environments as LeRobot knows them: ``--env.type=er_il --env.task=reach_cup --env.action_space=erj``."""

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import gymnasium
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv, VectorEnv
from lerobot.configs import FeatureType, PolicyFeature, parser
from lerobot.envs import EnvConfig
from lerobot.envs.utils import freeze_after_episode_end
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE

from er_il.control.commander import BEST_EFFORT
from er_il.envs.contract import check_policy
from er_il.envs.decoders import NEAREST, Decoder
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import DecodingEnv, make_decoding_env


@EnvConfig.register_subclass("er_il")
@dataclass
class ErIlEnvConfig(EnvConfig):
    """A simulated task whose actions are encoded in an action space.

    Attributes:
        action_space: ``joint``, ``task``, ``erj``, ``era``, or ``erj@<joint>`` if ERJ commands another joint.
        resolution: What IK does with the freedom that task space leaves: ``nearest`` or ``posture``.
        posture: Joint angles [rad] to which ``posture`` pulls; the arm's comfortable ones if empty.
        rotation: ``quat`` or ``rot6d``, as in the dataset that the policy was trained on.
        arm: Name of the arm.
        on_invalid: What the arm does with an invalid action: ``best_effort``, ``hold``, ``stop``.
        cameras: Cameras that the policy sees, none for a state-based policy.
        image_size: Width and height of their images [px].
    """

    task: str | None = "reach_cup"
    fps: int = 20
    action_space: str = "erj"
    resolution: str = NEAREST
    posture: list[float] = field(default_factory=list)
    rotation: str = "quat"
    arm: str = "panda"
    on_invalid: str = BEST_EFFORT
    cameras: list[str] = field(default_factory=list)
    image_size: int = 96

    def __post_init__(self) -> None:
        env = self.make()
        self.fps = int(env.metadata["render_fps"])
        self.features, self.features_map = _features(env)
        env.close()

    @property
    def gym_id(self) -> str:
        return task_id(self.task or "")

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        return {
            "arm": self.arm,
            "cameras": tuple(self.cameras),
            "image_size": self.image_size,
            "render_mode": "rgb_array",  # the stock commands film some episodes
        }

    def make(self) -> DecodingEnv:
        """Make one environment."""
        return _make(self.gym_id, self.gym_kwargs, self.decoder, self.rotation, self.on_invalid)

    @property
    def decoder(self) -> Decoder:
        """The decoder that the options name."""
        return Decoder(self.action_space, self.resolution, tuple(self.posture))

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv]]:
        # LeRobot's own commands tell an environment nothing about the policy it will meet, but
        # the last chance to refuse a wrong one is here.
        if policy := parser.get_path_arg("policy"):
            env = self.make()
            check_policy(policy, env.space)
            env.close()
        make = partial(_make, self.gym_id, self.gym_kwargs, self.decoder, self.rotation, self.on_invalid)
        # An episode that has ended waits for the batch's slowest; without the freeze its successor's
        # first steps would count into its metrics.
        factories = [freeze_after_episode_end(make)] * n_envs
        vector: VectorEnv
        if use_async_envs and n_envs > 1:
            # OpenGL contexts do not survive a fork.
            vector = AsyncVectorEnv(factories, context="forkserver", autoreset_mode=AutoresetMode.NEXT_STEP)
        else:
            vector = SyncVectorEnv(factories, autoreset_mode=AutoresetMode.NEXT_STEP)
        return {self.type: {0: vector}}


def _make(gym_id: str, gym_kwargs: dict[str, Any], decoder: Decoder, rotation: str, on_invalid: str) -> DecodingEnv:
    """Make an environment; at module level so that worker processes find it (and the tasks it needs)."""
    return make_decoding_env(gym_id, decoder, rotation=rotation, on_invalid=on_invalid, **gym_kwargs)


def _features(env: gymnasium.Env[Any, Any]) -> tuple[dict[str, PolicyFeature], dict[str, str]]:
    """LeRobot's features and their names for policies, read off an environment's spaces."""
    observation = env.observation_space
    assert isinstance(observation, gymnasium.spaces.Dict)
    assert env.action_space.shape is not None
    features = {ACTION: PolicyFeature(FeatureType.ACTION, env.action_space.shape)}
    names = {ACTION: ACTION}
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
    return features, names
