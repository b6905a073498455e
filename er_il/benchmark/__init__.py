"""Tasks times decoders times seeds: a grid of independent cells, run, resumed, counted and shown."""
