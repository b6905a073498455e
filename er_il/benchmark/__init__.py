"""Tasks times decoders times seeds: a grid of independent cells, run, resumed, counted and shown."""

REFERENCE = "joint"  # the decoder that the others are compared with, rollout by rollout
RESULTS = "results.json"  # the report, from which everything is rendered
