"""Forward and inverse kinematics of an arm, and its redundancy."""
