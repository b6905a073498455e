"""Agents to test with: one that was trained for moments, and one that homes in on the ball of Reach Target."""

from pathlib import Path

import torch

from er_il.envs import make_rl_env
from er_il.rl.export import agent_config, save_policy
from er_il.rl.modeling_agent import AgentPolicy
from er_il.rl.settings import Settings
from er_il.rl.training import AgentTraining

TASK, MODE = "reach_target", "task"
SMALL = Settings.shipped(pixels=False).replaced(
    environments=2, warm_up=40, batch_size=16, buffer=2000, layers=(16,), milestone=64, evaluations=1
)
LARGE = 100.0
GAIN = 20.0  # [1/m] of the hand's pace towards the ball: full pace from 5 cm on


def homing_agent(folder: Path) -> AgentPolicy:
    """Write an agent whose networks were set by hand: the hand moves towards the ball of Reach Target."""
    training = AgentTraining(TASK, MODE, 0, 0, SMALL.replaced(layers=(8,)), folder)
    env = make_rl_env(TASK, MODE)
    policy = AgentPolicy(agent_config(training, env, "cpu")).eval()
    hidden, mean = policy.actor.latent_pi[0], policy.actor.mu
    with torch.no_grad():
        for layer in (hidden, mean):
            layer.weight.zero_()
            layer.bias.zero_()
        hidden.bias[6:] = torch.tensor([LARGE, -LARGE])  # beside which a layer's norm is the same everywhere
        for axis, name in enumerate(("ball.dx", "ball.dy", "ball.dz")):
            for sign in (1, -1):  # a rectifier for either direction
                row = 2 * axis + (sign < 0)
                hidden.weight[row, env.observation_names.index(name)] = sign
                mean.weight[axis, row] = sign * GAIN * LARGE / 2  # the norm is half of it
    env.close()
    save_policy(policy, folder)
    return policy
