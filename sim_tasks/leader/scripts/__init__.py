"""The scripts by which the leader demonstrates the tasks, one file a family of tasks."""
