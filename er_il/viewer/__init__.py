"""An episode in Rerun: the arm in its world, what it was told and what it did."""

from er_il.viewer.show import save_recording, save_rollout

__all__ = ["save_recording", "save_rollout"]
