"""Replay of recorded actions by a follower: the upper bound of the success that an encoding allows.

A policy that imitated its demonstrations perfectly would do what a replay does. Where a replay
fails, the encoding has lost something that the task needs.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pandas as pd

from er_il.arms.robot import robot_arms
from er_il.datasets.dataset import Dataset
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import DatasetRecord, RecordedEpisode, read_episodes
from er_il.envs.decoders import DECODERS, decoder
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import ActionSpaceEnv, make_action_space_env
from er_il.evaluation.results import summarise
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.registry import name_of
from er_il.support.atomic_files import write_json
from er_il.support.workers import StatefulWorkers

# [s] The last action is held that long at most: a grip found a little later than in the demo is a grip all the same.
GRACE = 1.0


@dataclass(frozen=True)
class Replayed:
    """One demo, executed again."""

    seed: int
    success: bool
    failure: str  # "" after success
    deviation: float  # [rad] largest distance of a joint from where it was in the demo at that step, pushed or not
    max_joint_step: float  # [rad] largest joint change that a decoded action asked for
    statuses: Counter[str]  # of decoding, one a step
    rewards: tuple[float, float, float]  # at the first step; largest fall below the highest so far; at the last step


@dataclass(frozen=True)
class ReplayCell:
    """All demos of one dataset, executed through one decoder."""

    task: str
    decoder: str
    demos: tuple[Replayed, ...]
    dropped: Counter[str]  # why the leader's other starts gave no demo

    @property
    def successes(self) -> int:
        """Number of demos that succeeded again."""
        return sum(demo.success for demo in self.demos)

    def report(self) -> dict[str, Any]:
        """Return the cell as JSON."""
        return (
            {"task": self.task, "decoder": self.decoder}
            | summarise(pd.DataFrame(map(vars, self.demos)))
            | {
                "leader": {
                    "starts": len(self.demos) + self.dropped.total(),
                    "dropped": dict(self.dropped.most_common()),
                },
                "max_joint_deviation": max(demo.deviation for demo in self.demos),
                "rewards": {
                    "first": max(demo.rewards[0] for demo in self.demos),
                    "largest_fall": max(demo.rewards[1] for demo in self.demos),
                    "last": min(demo.rewards[2] for demo in self.demos),
                },
                "demos": [
                    {
                        "seed": demo.seed,
                        "success": demo.success,
                        "failure": demo.failure,
                        "max_deviation": demo.deviation,
                    }
                    for demo in self.demos
                ],
            }
        )


def replay(datasets: Sequence[Path], workers: int, advance: Callable[[Path, str, int, int], None]) -> list[ReplayCell]:
    """Execute every demo of every dataset through each decoder that reads the dataset's space and works in its world.

    Args:
        datasets: Folders of datasets.
        workers: Number of worker processes.
        advance: Called after each demo with the dataset, the decoder's name, the demos done, and their number.

    Raises:
        DatasetError: a folder is no dataset of ``er-il generate``.
        SpecError: a dataset's actions mean something else in this version of er_il.
    """
    plays = [(dataset, play, read_episodes(dataset)) for dataset in datasets for play in _plays(dataset)]
    cells = []
    with StatefulWorkers(workers, _Worker) as pool:
        running = [
            (path, play, [pool.submit(_Worker.replay, play, demo) for demo in demos]) for path, play, demos in plays
        ]
        for path, play, results in running:
            done = []
            for result in results:
                done.append(result())
                advance(path, play.decoder, len(done), len(results))
            dropped = Counter(DatasetRecord.read(path).dropped.values())
            cells.append(ReplayCell(play.recipe.task, play.decoder, tuple(done), dropped))
    return cells


def replay_demo(world: ActionSpaceEnv, demo: RecordedEpisode) -> Replayed:
    """Execute a demo's actions in the world it was recorded in."""
    world.reset(seed=demo.seed)
    grace = round(GRACE * world.metadata["render_fps"])
    actions = np.concatenate([demo.actions, np.repeat(demo.actions[-1:], grace, axis=0)])
    joints = demo.state[:, : len(world.last_command)]
    deviation = joint_step = 0.0
    statuses: Counter[str] = Counter()
    info: dict[str, Any] = {}
    rewards: list[float] = []
    for step, action in enumerate(actions):
        if step < len(joints):
            deviation = max(deviation, float(np.max(np.abs(world.world.joint_positions - joints[step]))))
        _, reward, terminated, truncated, info = world.step(action)
        rewards.append(reward)
        statuses[info["decode_status"]] += 1
        joint_step = max(joint_step, info["joint_step"])
        if terminated or truncated:
            break
    success = bool(info["is_success"])
    failure = "" if success else info["failure"] or "unfinished"
    falls = np.maximum.accumulate(rewards) - rewards
    told = rewards[0], float(falls.max()), rewards[-1]
    return Replayed(demo.seed, success, failure, deviation, joint_step, statuses, told)


def write_report(cells: Sequence[ReplayCell], meta: dict[str, Any], path: Path) -> None:
    """Write the cells as JSON, in the form of every report."""
    write_json(path, {"meta": meta, "cells": [cell.report() for cell in cells]})


@dataclass(frozen=True)
class _Play:
    """A world and a decoder."""

    recipe: Recipe
    decoder: str
    rotation: str

    def make(self) -> ActionSpaceEnv:
        environment = self.recipe.replaced(cameras=()).environment
        return make_action_space_env(
            task_id(self.recipe.task), decoder(self.decoder), rotation=self.rotation, **environment
        )


def _plays(dataset: Path) -> list[_Play]:
    first = Dataset(dataset).layout.parts[0]  # refuses what this version would decode differently
    recipe = DatasetRecord.read(dataset).recipe
    name = name_of(first.space, robot_arms(recipe.arm)[first.label])
    rotation = first.space.spec().get("rotation", Quaternion.kind)
    with closing(gymnasium.make(task_id(recipe.task), **recipe.replaced(cameras=()).environment)) as env:
        readers = [key for key, each in DECODERS.items() if each.space == name and each.works_in(env)] or [name]
    return [_Play(recipe, reader, rotation) for reader in readers]


@dataclass
class _Worker:
    """The world that a worker has open: demos of one play come one after the other."""

    play: _Play | None = None
    world: ActionSpaceEnv | None = None

    def replay(self, play: _Play, demo: RecordedEpisode) -> Replayed:
        if self.world is None or play != self.play:
            self.play, self.world = play, play.make()
        return replay_demo(self.world, demo)
