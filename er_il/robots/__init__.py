"""Policies and devices on LeRobot's robot commands."""
