"""Arms: their joints, frames and limits, read from a URDF or known by name."""
