"""LeRobot datasets: recorded, re-encoded, verified."""
