"""The scripted leader arm, its motion planning, and a script for each task."""

import sim_tasks.world  # noqa: F401  chooses the GL backend before MuJoCo is imported
