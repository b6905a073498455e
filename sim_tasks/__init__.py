"""MuJoCo tasks for a redundant arm, as Gymnasium environments."""
