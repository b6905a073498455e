"""A trained agent as the demonstrator of a dataset: reinforcement learning feeds imitation."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from er_il.datasets.demos import Demo, Record
from er_il.datasets.recipe import Recipe
from er_il.envs.learning import RATE, LearningEnv
from er_il.evaluation.rollout import TIMEOUT
from er_il.policy.actor import one_thread
from er_il.rl.assessment import environment_of
from er_il.rl.evaluation import Act
from er_il.rl.loading import load_agent
from er_il.support.errors import PolicyError


@dataclass(frozen=True)
class AgentDemonstrator:
    """Demonstrates as an agent acts without exploration; an episode that does not end in success is dropped."""

    folder: Path  # of the agent

    def recipe(self, recipe: Recipe) -> Recipe:
        """The recipe of the agent's demonstrations: at the rate at which it decides.

        Raises:
            PolicyError: there is no agent, or it learnt another task or with another arm.
        """
        config = load_agent(self.folder).config
        for key in ("task", "arm"):
            if (learnt := getattr(config, key)) != (asked := getattr(recipe, key)):
                raise PolicyError(f"The agent {self.folder} learnt with the {key} {learnt}, not {asked}.")
        return recipe.replaced(agent=str(self.folder), rate=RATE, disturbance=0.0)

    def starting(self, recipe: Recipe) -> Record:
        agent = load_agent(self.folder)
        seen: dict[str, Any] = {} if agent.cameras else {"cameras": recipe.cameras, "image_size": recipe.image_size}
        return partial(_record, agent.act, environment_of(agent, **seen, **recipe.randomisation))


def _record(act: Act, env: LearningEnv, seed: int) -> Demo | str:
    observation, info = env.reset(seed=seed)
    seen, joints, done = [], [], False
    with one_thread():
        while not done:
            action = act(observation)
            seen.append(env.seen)
            observation, _, terminated, truncated, info = env.step(action)
            joints.append(np.append(info["command"], env.change(action)[-1]))
            done = terminated or truncated
    if not info["is_success"]:
        return info["failure"] or TIMEOUT
    return Demo.of_episode(seed, joints, seen)
