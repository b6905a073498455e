"""LeRobot datasets: recording, re-encoding, verifying and replaying them."""
