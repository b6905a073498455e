"""The number of observations that a policy acts on at once."""

# Matrix products of another shape round differently, and contact amplifies the last bit into another
# outcome. So the policy always sees this many rows, the missing ones filled up: then an episode's
# outcome depends on its seed alone, not on how many run beside it.
POLICY_ROWS = 25
