"""Studies of the action spaces by kinematics."""
