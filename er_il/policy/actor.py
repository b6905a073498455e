"""A trained policy with its processors, and the environment it was trained for."""

import io
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from huggingface_hub.constants import SAFETENSORS_SINGLE_FILE
from lerobot.configs import FeatureType, PreTrainedConfig
from lerobot.envs import preprocess_observation
from lerobot.policies import PreTrainedPolicy, make_policy
from lerobot.utils.constants import OBS_IMAGES
from safetensors.torch import load_model
from threadpoolctl import threadpool_limits

from er_il.control.commander import BEST_EFFORT
from er_il.envs.contract import decoder_for, policy_contract
from er_il.envs.learning import RATE
from er_il.envs.lerobot_plugin import ErIlEnvConfig
from er_il.envs.origin import training_info
from er_il.policy.chunk_pipelines import make_pre_post_processors
from er_il.policy.rows import POLICY_ROWS
from er_il.support.errors import PolicyError


def environment_of(
    policy: Path,
    task: str,
    decoder_name: str,
    on_invalid: str = BEST_EFFORT,
    posture: Sequence[float] = (),
    within: float | None = None,
) -> ErIlEnvConfig:
    """Describe the environment that a policy needs: its arm, its rotation code, its cameras, its rate.

    Check the policy against the environment that comes of it: :func:`er_il.envs.contract.check_policy`.
    """
    contract = policy_contract(policy)
    chosen = decoder_for(decoder_name, contract)
    images = _load_config(policy).image_features
    sizes = {feature.shape[-1] for feature in images.values()}
    info = training_info(policy)
    return ErIlEnvConfig(
        task=task,
        fps=RATE if info and info["fps"] == RATE else ErIlEnvConfig.fps,  # an agent demonstrated
        action_space=chosen.space,
        resolution=chosen.resolution,
        posture=list(posture),
        rotation=contract.rotation_code,
        arm=contract.arm,
        on_invalid=on_invalid,
        cameras=[key.removeprefix(f"{OBS_IMAGES}.") for key in images],
        image_size=sizes.pop() if sizes else ErIlEnvConfig.image_size,
        within=within or 0.0,
    )


@contextmanager
def one_thread() -> Iterator[None]:
    """Compute with one thread: rounding depends on their number, and contact amplifies it into other outcomes."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with threadpool_limits(1):
            yield
    finally:
        torch.set_num_threads(threads)


@contextmanager
def loading(policy: Path) -> Iterator[None]:
    """Tell by the policy's folder what loading its files raises, which is all kinds of errors of LeRobot and torch."""
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:
        said = " ".join(str(error).split()) or "no reason is given"
        raise PolicyError(f"LeRobot cannot load the policy {policy} ({type(error).__name__}): {said}") from error


def check_weights(policy: PreTrainedPolicy, path: Path) -> None:
    """Raise a RuntimeError where the file of the weights is not of this policy: LeRobot leaves what it lacks random."""
    own = type(policy)
    loads_as_others = own.from_pretrained.__func__ is PreTrainedPolicy.from_pretrained.__func__
    if loads_as_others and (weights := path / SAFETENSORS_SINGLE_FILE).is_file():
        load_model(policy, weights, strict=True)


def _load_config(policy: Path) -> PreTrainedConfig:
    with loading(policy):
        config = PreTrainedConfig.from_pretrained(policy)
    config.pretrained_path = policy
    if hasattr(config, "pretrained_backbone_weights"):
        config.pretrained_backbone_weights = None  # pyrefly: ignore[missing-attribute]  the checkpoint has them
    return config


@dataclass(frozen=True)
class Actor:
    """A policy with its processors."""

    policy: PreTrainedPolicy
    preprocess: Callable[[dict[str, Any]], dict[str, Any]]
    postprocess: Callable[[torch.Tensor], torch.Tensor]

    @classmethod
    def load(cls, path: Path, config: ErIlEnvConfig) -> "Actor":
        policy_config = _load_config(path)
        trained = policy_config.action_feature
        if trained is None or trained.shape != config.features["action"].shape:
            raise PolicyError(
                f"The policy {path} does not act in {config.action_space} space: its actions differ in length."
            )
        with loading(path), redirect_stdout(io.StringIO()):  # LeRobot announces every file it loads
            policy = make_policy(policy_config, env_cfg=config)
            check_weights(policy, path)
        policy.eval()
        overrides = {"device_processor": {"device": str(policy.config.device)}}
        with loading(path):
            preprocess, postprocess = make_pre_post_processors(
                policy_config, pretrained_path=str(path), preprocessor_overrides=overrides
            )
            actor = cls(policy, preprocess, postprocess)
            # What is wrong in a processor's settings shows at its first use.
            actor.act(_blank(config), config.task or "")
        return actor

    def reset(self, seed: int) -> None:
        """Begin episodes. Some policies, such as Diffusion, draw random numbers: from ``seed`` on, the same ones."""
        torch.manual_seed(seed)
        self.policy.reset()

    def act(self, observation: dict[str, Any], task: str) -> np.ndarray:
        """Return an action (N, dim) a row of the observation, N up to ``POLICY_ROWS``."""
        batch: dict[str, Any] = {key: _filled(rows) for key, rows in preprocess_observation(observation).items()}
        batch["task"] = [task] * POLICY_ROWS
        with torch.inference_mode():
            action = self.postprocess(self.policy.select_action(self.preprocess(batch)))
        return action.cpu().numpy()


def _blank(config: ErIlEnvConfig) -> dict[str, Any]:
    """An observation of one environment in which everything is zero."""
    observation: dict[str, Any] = {}
    for key, feature in config.features.items():
        if feature.type is FeatureType.VISUAL:
            pixels = observation.setdefault("pixels", {})
            pixels[key.removeprefix("pixels/")] = np.zeros((1, *feature.shape), dtype=np.uint8)
        elif feature.type is not FeatureType.ACTION:
            observation[key] = np.zeros((1, *feature.shape), dtype=np.float32)
    return observation


def _filled(rows: torch.Tensor) -> torch.Tensor:
    """Repeat the last row up to ``POLICY_ROWS`` rows."""
    return torch.cat([rows, rows[-1:].expand(POLICY_ROWS - len(rows), *rows.shape[1:])])
