"""The main job in one call, and what a reader sees of results."""
