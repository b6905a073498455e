"""Rollouts of a trained policy through a decoder, batched, and what they amount to."""

import csv
import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.vector import SyncVectorEnv
from lerobot.configs import PreTrainedConfig
from lerobot.envs import preprocess_observation
from lerobot.envs.utils import NEW_ROLLOUT_OPTION
from lerobot.policies import PreTrainedPolicy, make_policy, make_pre_post_processors
from lerobot.utils.constants import OBS_IMAGES

from er_il.command import BEST_EFFORT
from er_il.contract import NONE, check_policy, policy_contract
from er_il.decoders import decoder
from er_il.errors import ErIlError, PolicyError
from er_il.kinematics import Status
from er_il.lerobot_env import ErIlEnvConfig
from er_il.rotation import Quaternion
from er_il.statistics import exact_interval

FIRST_SEED = 1000  # LeRobot's own; demonstrations use seeds from a million up
TIMEOUT = "timeout"

# Matrix products of another shape round differently, and contact amplifies the last bit into another
# outcome. So the policy always sees this many rows, the missing ones filled up: then an episode's
# outcome depends on its seed alone, not on how many run beside it.
POLICY_ROWS = 25


@dataclass(frozen=True)
class Episode:
    """One rollout."""

    seed: int
    success: bool
    failure: str  # "" after success
    statuses: Counter[str]  # of decoding, one a step
    latencies: tuple[float, ...]  # [s] of decoding, one a step
    joint_step: float  # [rad] largest joint change that a decoded action asked for

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.latencies)

    @property
    def invalid(self) -> int:
        """Number of actions whose status was not OK."""
        return self.steps - self.statuses[Status.OK]


@dataclass(frozen=True)
class Cell:
    """All episodes of one task and decoder."""

    task: str
    decoder: str
    episodes: tuple[Episode, ...]

    @property
    def successes(self) -> int:
        """Number of successful episodes."""
        return sum(episode.success for episode in self.episodes)

    @property
    def failures(self) -> Counter[str]:
        """How often each failure occurred."""
        return Counter(episode.failure for episode in self.episodes if not episode.success)

    def report(self) -> dict[str, Any]:
        """Return the cell as JSON."""
        latencies = np.concatenate([episode.latencies for episode in self.episodes])
        statuses = sum((episode.statuses for episode in self.episodes), Counter[str]())
        return {
            "task": self.task,
            "decoder": self.decoder,
            "successes": self.successes,
            "episodes": len(self.episodes),
            "interval": list(exact_interval(self.successes, len(self.episodes))),
            "failures": dict(self.failures.most_common()),
            "statuses": dict(statuses.most_common()),
            "invalid_rate": sum(episode.invalid for episode in self.episodes) / len(latencies),
            "decode_p50_ms": 1e3 * float(np.percentile(latencies, 50)),
            "decode_p99_ms": 1e3 * float(np.percentile(latencies, 99)),
            "max_joint_step": max(episode.joint_step for episode in self.episodes),
            "mean_steps": len(latencies) / len(self.episodes),
        }


def evaluate(
    policy: Path,
    task: str,
    decoder_name: str,
    *,
    episodes: int = 50,
    seed: int = FIRST_SEED,
    on_invalid: str = BEST_EFFORT,
    batch_size: int = POLICY_ROWS,
    advance: Callable[[int], None] = lambda episodes: None,
) -> Cell:
    """Roll a policy out on the seeds ``seed, seed + 1, ...``.

    Args:
        policy: Folder of the pretrained policy.
        task: Name of the task.
        decoder_name: ``joint``, ``task-nearest``, ``task-posture``, ``erj``.
        episodes: Number of rollouts.
        seed: Seed of the first one; the same seed is the same initial state for every decoder.
        on_invalid: See :class:`er_il.command.Commander`.
        batch_size: Environments side by side, up to ``POLICY_ROWS``; it changes no result.
        advance: Called with the number of episodes just finished.

    Raises:
        PolicyError: the policy is missing, or was trained for another action space or other cameras.
        UnknownNameError: no such task or decoder.
        ErIlError: no episodes.
    """
    if episodes < 1:
        raise ErIlError(f"{episodes} episodes say nothing; ask for at least one.")
    if not 1 <= batch_size <= POLICY_ROWS:
        raise ErIlError(f"The batch size is {batch_size}; it must be between 1 and {POLICY_ROWS}.")
    config = _environment(policy, task, decoder_name, on_invalid)
    actor = _Actor.load(policy, config)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # rounding depends on the number of threads, too
    vector = config.create_envs(min(batch_size, episodes))[config.type][0]
    assert isinstance(vector, SyncVectorEnv)
    try:
        done: list[Episode] = []
        while len(done) < episodes:
            seeds = list(range(seed + len(done), seed + min(len(done) + vector.num_envs, episodes)))
            done += _rollout(vector, actor, seeds)
            advance(len(seeds))
    finally:
        vector.close()
        torch.set_num_threads(threads)
    return Cell(task, decoder_name, tuple(done))


def write_cells(cells: Sequence[Cell], meta: dict[str, Any], folder: Path) -> None:
    """Write ``report.json`` and one row an episode in ``episodes.csv``."""
    folder.mkdir(parents=True, exist_ok=True)
    report = {"meta": meta, "cells": [cell.report() for cell in cells]}
    _write(folder / "report.json", lambda path: path.write_text(json.dumps(report, indent=2) + "\n"))
    _write(folder / "episodes.csv", lambda path: _write_csv(cells, path))


def _write_csv(cells: Sequence[Cell], path: Path) -> None:
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["task", "decoder", "seed", "success", "failure", "steps", "invalid", "max_joint_step"])
        for cell in cells:
            for e in cell.episodes:
                rows.writerow(
                    [
                        cell.task,
                        cell.decoder,
                        e.seed,
                        int(e.success),
                        e.failure,
                        e.steps,
                        e.invalid,
                        f"{e.joint_step:.6f}",
                    ]
                )


def _write(path: Path, write: Callable[[Path], object]) -> None:
    partial = path.with_name(path.name + ".partial")
    write(partial)
    partial.rename(path)


def _environment(policy: Path, task: str, decoder_name: str, on_invalid: str) -> ErIlEnvConfig:
    """Build the environment that a policy needs: its rotation code, its cameras."""
    chosen = decoder(decoder_name)
    contract = policy_contract(policy)
    images = _load_config(policy).image_features
    sizes = {feature.shape[-1] for feature in images.values()}
    config = ErIlEnvConfig(
        task=task,
        action_space=chosen.space,
        resolution=chosen.resolution,
        rotation=Quaternion.kind if contract.rotation == NONE else contract.rotation,
        on_invalid=on_invalid,
        cameras=[key.removeprefix(f"{OBS_IMAGES}.") for key in images],
        image_size=sizes.pop() if sizes else ErIlEnvConfig.image_size,
    )
    env = config.make()
    check_policy(policy, env.space)
    env.close()
    return config


def _load_config(policy: Path) -> PreTrainedConfig:
    config = PreTrainedConfig.from_pretrained(policy)
    config.pretrained_path = policy
    if hasattr(config, "pretrained_backbone_weights"):
        config.pretrained_backbone_weights = None  # pyright: ignore[reportAttributeAccessIssue]  the checkpoint has them
    return config


@dataclass(frozen=True)
class _Actor:
    """A policy with its processors."""

    policy: PreTrainedPolicy
    preprocess: Callable[[dict[str, Any]], dict[str, Any]]
    postprocess: Callable[[torch.Tensor], torch.Tensor]

    @classmethod
    def load(cls, path: Path, config: ErIlEnvConfig) -> "_Actor":
        policy_config = _load_config(path)
        trained = policy_config.action_feature
        if trained is None or trained.shape != config.features["action"].shape:
            raise PolicyError(
                f"The policy {path} does not act in {config.action_space} space: its actions differ in length."
            )
        policy = make_policy(policy_config, env_cfg=config)
        policy.eval()
        overrides = {"device_processor": {"device": str(policy.config.device)}}
        preprocess, postprocess = make_pre_post_processors(
            policy_config, pretrained_path=str(path), preprocessor_overrides=overrides
        )
        return cls(policy, preprocess, postprocess)

    def act(self, observation: dict[str, Any], task: str) -> np.ndarray:
        """Return an action (N, dim) a row of the observation, N up to ``POLICY_ROWS``."""
        batch: dict[str, Any] = {key: _filled(rows) for key, rows in preprocess_observation(observation).items()}
        batch["task"] = [task] * POLICY_ROWS
        with torch.inference_mode():
            action = self.postprocess(self.policy.select_action(self.preprocess(batch)))
        return action.cpu().numpy()


def _filled(rows: torch.Tensor) -> torch.Tensor:
    """Repeat the last row up to ``POLICY_ROWS`` rows."""
    return torch.cat([rows, rows[-1:].expand(POLICY_ROWS - len(rows), *rows.shape[1:])])


def _rollout(vector: SyncVectorEnv, actor: _Actor, seeds: list[int]) -> list[Episode]:
    """Run one episode a seed, side by side, until the last has ended."""
    n = vector.num_envs
    # An environment without a seed of its own repeats the last: its outcome is dropped.
    all_seeds: list[int | None] = [*seeds, *seeds[-1:] * (n - len(seeds))]
    observation, _ = vector.reset(seed=all_seeds, options={NEW_ROLLOUT_OPTION: True})
    actor.policy.reset()
    description = vector.get_attr("task_description")[0]
    done = np.zeros(n, dtype=bool)
    success, failure = np.zeros(n, dtype=bool), [""] * n
    while not done.all():
        observation, _, terminated, truncated, info = vector.step(actor.act(observation, description)[:n])
        for i in np.flatnonzero(~done):
            success[i] = info["is_success"][i]
            failure[i] = "" if success[i] else info["failure"][i] or TIMEOUT
        done |= terminated | truncated
    tallies = [commander.tally for commander in vector.get_attr("commander")]
    return [
        Episode(
            seed=seed,
            success=bool(success[i]),
            failure=failure[i],
            statuses=Counter(map(str, tallies[i].statuses.elements())),
            latencies=tuple(tallies[i].latencies),
            joint_step=tallies[i].largest_step,
        )
        for i, seed in enumerate(seeds)
    ]
