"""Rollouts and replays, and what they amount to."""
