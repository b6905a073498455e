"""Grids of trainings and rollouts, and studies of the action spaces."""
