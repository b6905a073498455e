"""An agent as LeRobot knows policies: LeRobot's usual processors, which normalise nothing."""

from typing import Any

from lerobot.processor.factory import make_default_pre_post_processors

from er_il.rl.configuration_agent import AgentConfig


def make_er_il_agent_pre_post_processors(config: AgentConfig, dataset_stats: Any = None) -> tuple[Any, Any]:
    """The processors of an agent; LeRobot finds this function by its name."""
    return make_default_pre_post_processors(config, dataset_stats)
