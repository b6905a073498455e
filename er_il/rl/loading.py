"""Trained agents from their folders."""

import io
from contextlib import redirect_stdout
from pathlib import Path

from er_il.envs.contract import read_policy_config
from er_il.policy.actor import check_weights, loading
from er_il.policy.training import pretrained
from er_il.rl.modeling_agent import AgentPolicy
from er_il.support.errors import PolicyError


def load_agent(path: Path) -> AgentPolicy:
    """Load an agent from the output of its training, or the pretrained model in it.

    Raises:
        PolicyError: there is none, it is another policy, or damaged.
    """
    folder = pretrained(path)
    if (kind := read_policy_config(folder)["type"]) != AgentPolicy.name:
        raise PolicyError(f"{path} is a policy of type {kind}, no agent. Roll it out with er-il eval.")
    with loading(folder), redirect_stdout(io.StringIO()):  # LeRobot announces every file it loads
        policy = AgentPolicy.from_pretrained(folder)
        check_weights(policy, folder)
    assert isinstance(policy, AgentPolicy)
    return policy
