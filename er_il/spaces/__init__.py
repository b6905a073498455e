"""The action spaces: joint, task and the paper's redundancy-aware ER family, absolute or as deltas."""
