"""Rollouts of a trained policy through a decoder, batched."""

from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
from gymnasium.vector import SyncVectorEnv
from lerobot.envs.utils import NEW_ROLLOUT_OPTION

from er_il.control.commander import BEST_EFFORT
from er_il.evaluation.checks import check_evaluation
from er_il.evaluation.elbow import ElbowReference
from er_il.evaluation.rollout import FIRST_SEED, TIMEOUT, Rollout
from er_il.policy.actor import Actor, environment_of, one_thread
from er_il.policy.rows import POLICY_ROWS
from er_il.support.errors import ErIlError


def evaluate(
    policy: Path,
    task: str,
    decoder_name: str,
    *,
    episodes: int = 50,
    seed: int = FIRST_SEED,
    on_invalid: str = BEST_EFFORT,
    posture: Sequence[float] = (),
    elbow: ElbowReference | None = None,
    within: float | None = None,
    batch_size: int = POLICY_ROWS,
    trust: bool = False,
    advance: Callable[[int], None] = lambda episodes: None,
) -> list[Rollout]:
    """Roll a policy out on the seeds ``seed, seed + 1, ...``.

    Args:
        policy: Folder of the pretrained policy.
        task: Name of the task.
        decoder_name: ``joint``, ``task-nearest``, ``task-posture``, ``task-clear``, ``erj``, ``era``, ``erx``,
            ``erj@JOINT``, ``era@stereo``.
        episodes: Number of rollouts.
        seed: Seed of the first one; the same seed is the same initial state for every decoder.
        on_invalid: See :class:`er_il.control.commander.Commander`.
        posture: (n,) [rad] to which ``task-posture`` pulls; the arm's comfortable one if empty.
        elbow: What to measure the elbow against, if anything.
        within: Side [m] of the square in which the cup starts; the task's own range if None.
        batch_size: Environments side by side, up to ``POLICY_ROWS``; it changes no result, unless the policy
            draws random numbers, as Diffusion does.
        trust: See :func:`er_il.envs.contract.check_policy`.
        advance: Called with the number of rollouts just finished.

    Raises:
        PolicyError: the policy is missing, or was trained for another action space or other cameras.
        UnknownNameError: no such task or decoder.
        ErIlError: no episodes.
    """
    check_evaluation(policy, task, decoder_name, episodes, on_invalid, trust)
    if not 1 <= batch_size <= POLICY_ROWS:
        raise ErIlError(f"The batch size is {batch_size}; it must be between 1 and {POLICY_ROWS}.")
    config = environment_of(policy, task, decoder_name, on_invalid, posture, within)
    vector = config.create_envs(min(batch_size, episodes))[config.type][0]
    assert isinstance(vector, SyncVectorEnv)
    with closing(vector), one_thread():
        actor = Actor.load(policy, config)
        done: list[Rollout] = []
        while len(done) < episodes:
            seeds = list(range(seed + len(done), seed + min(len(done) + vector.num_envs, episodes)))
            done += _roll_out(vector, actor, seeds, elbow)
            advance(len(seeds))
    return done


def _roll_out(vector: SyncVectorEnv, actor: Actor, seeds: list[int], elbow: ElbowReference | None) -> list[Rollout]:
    """Run one rollout a seed, side by side, until the last has ended."""
    n = vector.num_envs
    # An environment without a seed of its own repeats the last: its outcome is dropped.
    all_seeds: list[int | None] = [*seeds, *seeds[-1:] * (n - len(seeds))]
    observation, _ = vector.reset(seed=all_seeds, options={NEW_ROLLOUT_OPTION: True})
    actor.reset(seeds[0])
    description = vector.get_attr("task_description")[0]
    done = np.zeros(n, dtype=bool)
    success, failure = np.zeros(n, dtype=bool), [""] * n
    paths: list[list[np.ndarray]] = [[] for _ in seeds]  # of the joints, with the hand's pose behind them
    while not done.all():
        for i in np.flatnonzero(~done[: len(seeds)]):
            paths[i].append(observation["agent_pos"][i].copy())
        observation, _, terminated, truncated, info = vector.step(actor.act(observation, description)[:n])
        for i in np.flatnonzero(~done):
            success[i] = info["is_success"][i]
            failure[i] = "" if success[i] else info["failure"][i] or TIMEOUT
        done |= terminated | truncated
    tallies = vector.get_attr("tally")
    return [
        Rollout(
            seed=seed,
            success=bool(success[i]),
            failure=failure[i],
            statuses=Counter(map(str, tallies[i].statuses.elements())),
            latencies=tuple(tallies[i].latencies),
            joint_step=tallies[i].largest_step,
            elbow_error=elbow.error(np.array(paths[i], dtype=np.float64)[:, : elbow.arm.dof]) if elbow else None,
        )
        for i, seed in enumerate(seeds)
    ]
