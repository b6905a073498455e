"""Studies of the action spaces: which actions are invalid, and which joints ERJ should command."""
