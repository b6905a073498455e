"""A trained agent as a LeRobot policy."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from lerobot.configs import FeatureType, PolicyFeature
from lerobot.utils.constants import ACTION, OBS_IMAGES, OBS_STATE
from stable_baselines3 import SAC

from er_il.envs.learning import CAMERAS, IMAGE_SIZE, LearningEnv
from er_il.rl.configuration_agent import AgentConfig
from er_il.rl.modeling_agent import AgentPolicy
from er_il.rl.processor_agent import make_er_il_agent_pre_post_processors

if TYPE_CHECKING:
    from er_il.rl.training import AgentTraining


def make_policy(env: LearningEnv, training: "AgentTraining", learners: Mapping[str, SAC]) -> AgentPolicy:
    """The policy of an agent as it is now.

    Args:
        env: An environment of the training.
        training: What is trained.
        learners: The agent (``task``) and, of JAiLeR, its ``controller``.
    """
    agent = learners["task"]
    policy = AgentPolicy(agent_config(training, env, str(agent.device)))
    policy.actor.load_state_dict(agent.actor.state_dict())
    if policy.controller is not None:
        policy.controller.load_state_dict(learners["controller"].actor.state_dict())
    return policy.to(agent.device).eval()


def agent_config(training: "AgentTraining", env: LearningEnv, device: str) -> AgentConfig:
    """The configuration of a training's agent, from an environment of it."""
    inputs = {OBS_STATE: PolicyFeature(FeatureType.STATE, (len(env.observation_names),))}
    if training.pixels:
        image = PolicyFeature(FeatureType.VISUAL, (3, IMAGE_SIZE, IMAGE_SIZE))
        inputs |= {f"{OBS_IMAGES}.{camera}": image for camera in CAMERAS}
    return AgentConfig(
        input_features=inputs,
        output_features={ACTION: PolicyFeature(FeatureType.ACTION, (len(env.action_names),))},
        device=device,
        push_to_hub=False,
        task=training.task,
        mode=training.mode,
        arm=training.arm,
        layers=list(training.settings.layers),
        state_names=list(env.observation_names),
        action_names=list(env.action_names),
    )


def save_policy(policy: AgentPolicy, folder: Path) -> None:
    """Write a policy with its processors, as LeRobot does."""
    policy.save_pretrained(folder)
    for processors in make_er_il_agent_pre_post_processors(policy.config):
        processors.save_pretrained(folder)
