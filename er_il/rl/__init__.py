"""Reinforcement learning (paper V-A): agents in every action mode, trained by Stable-Baselines3's SAC."""
