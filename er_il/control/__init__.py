"""From an action to a command that the arm can follow."""
