"""An episode in Rerun: the arm in its world, what it was told and what it did."""
