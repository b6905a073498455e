"""What a trained agent can do: rollouts, counted, and some of them filmed."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from er_il.envs.learning import LearningEnv, make_rl_env
from er_il.evaluation.results import COUNTS, as_csv, long_form, summarise
from er_il.policy.actor import one_thread
from er_il.rl.evaluation import roll_out
from er_il.rl.modeling_agent import AgentPolicy
from er_il.rl.modes import mode_of_environment
from er_il.rl.recording import film_episode
from er_il.support.atomic_files import write_atomically, write_json
from er_il.support.provenance import provenance


def environment_of(agent: AgentPolicy, **settings: Any) -> LearningEnv:
    """The environment that an agent was trained for; for the settings see :class:`LearningEnv`."""
    config = agent.config
    mode = mode_of_environment(config.mode)
    return make_rl_env(config.task, mode, pixels=bool(agent.cameras), arm=config.arm, **settings)


def assess(
    agent: AgentPolicy, seeds: Sequence[int], films: int, folder: Path, advance: Callable[[], None]
) -> dict[str, Any]:
    """Roll an agent out and write ``report.json``, ``episodes.csv``, and of the first episodes films and recordings.

    Args:
        agent: The agent.
        seeds: Of the starts.
        films: How many episodes to film.
        folder: Where to write.
        advance: Called after each episode, the filmed ones after those that count.

    Returns:
        What the report says (:func:`er_il.evaluation.results.summarise`).
    """
    task, mode = agent.config.task, agent.config.mode
    with one_thread(), closing(environment_of(agent)) as env:
        done = []
        for seed in seeds:
            done += roll_out(agent.act, env, [seed])
            advance()
    rollouts = long_form([({"task": task, "decoder": mode}, done)])
    report = summarise(rollouts)
    meta = provenance() | {"first_seed": seeds[0], "episodes": len(seeds)}
    write_json(folder / "report.json", {"meta": meta, "cells": [{"task": task, "mode": mode} | report]})
    text = as_csv(rollouts, ["task", "decoder", *COUNTS])
    write_atomically(folder / "episodes.csv", lambda path: path.write_text(text))
    for _ in film(agent, seeds[:films], folder):
        advance()
    return report


def film(agent: AgentPolicy, seeds: Sequence[int], folder: Path) -> Iterator[Path]:
    """Film an agent's episodes, each with a recording for Rerun and a trace beside it.

    Yields:
        The path of each film.
    """
    if not seeds:
        return
    with one_thread(), closing(environment_of(agent, render_mode="rgb_array")) as env:
        for seed in seeds:
            path = folder / f"episode_{seed}.mp4"
            film_episode(agent.act, env, agent.config.task, agent.config.mode, seed, path)
            yield path
