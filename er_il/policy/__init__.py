"""Trained policies: the contract with a rollout, training, rolling out and counting."""
