"""The scripted leader: motion planning and playing."""
