"""MuJoCo worlds: the robot, its surroundings, cameras and contacts."""
