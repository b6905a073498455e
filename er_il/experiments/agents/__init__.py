"""Experiments with agents: reinforcement learning over tasks, action modes and seeds."""
