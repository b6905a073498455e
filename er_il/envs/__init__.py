"""Simulated environments that take encoded actions."""
