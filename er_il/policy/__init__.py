"""Policies: training with LeRobot's command, and acting with what was trained."""
