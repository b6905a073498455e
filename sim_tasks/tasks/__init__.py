"""Tasks: each builds its world, places objects, judges episodes and gives rewards."""

import sim_tasks.world  # noqa: F401  chooses the GL backend before MuJoCo is imported
