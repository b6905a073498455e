"""Round trips: decode(encode(q), seed near q) returns q, or the cause of the miss is determined."""

from dataclasses import dataclass

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.search import at_limits
from er_il.kinematics.solver import Status
from er_il.spaces.base import ArmSpace, Array

EXACT = 1e-3  # [rad] a decode that misses a joint by more has not returned the configuration
SINGULAR = 2e-2  # a smallest singular value (m and rad mixed) below this explains a miss

# Causes of a miss, the first that applies: a limit stands between; another solution meets the action and is nearer the
# seed, so that no decoder could tell; solutions all but meet there; the status says that the search gave up.
LIMIT, AMBIGUOUS, ILL_CONDITIONED, REPORTED = "limit", "ambiguous", "ill-conditioned", "reported"
UNEXPLAINED = "unexplained"
CAUSES = (LIMIT, AMBIGUOUS, ILL_CONDITIONED, REPORTED, UNEXPLAINED)


@dataclass(frozen=True)
class RoundTrip:
    """One configuration encoded, and decoded from a seed nearby."""

    q: Vector  # (n,) [rad]
    seed: Vector  # (n,) [rad]
    found: Vector  # (n,) [rad] what the action decodes to
    status: Status
    conditioning: float  # at q, see Kinematics.conditioning; infinite in joint space
    at_limit: bool  # a decoded joint is at its limit

    @property
    def exact(self) -> bool:
        """True if the configuration came back."""
        return float(np.abs(self.found - self.q).max()) <= EXACT

    @property
    def cause(self) -> str:
        """Cause of a miss, one of ``CAUSES``; "" if the configuration came back."""
        if self.exact:
            return ""
        if self.at_limit or self.status is Status.LIMIT:
            return LIMIT
        if self.ambiguous:
            return AMBIGUOUS
        if self.conditioning < SINGULAR:
            return ILL_CONDITIONED
        return UNEXPLAINED if self.status is Status.OK else REPORTED

    @property
    def ambiguous(self) -> bool:
        """True if another solution is as good and nearer the seed: action and seed cannot tell which was meant."""
        nearer = np.linalg.norm(self.found - self.seed) <= np.linalg.norm(self.q - self.seed)
        return self.status is Status.OK and not self.exact and bool(nearer)


def round_trips(space: ArmSpace, count: int, *, seed_error: float = 0.1, rng_seed: int = 0) -> list[RoundTrip]:
    """Sample configurations uniformly within the limits, and seeds within ``seed_error`` [rad] of each joint."""
    arm = space.arm
    shares = np.random.default_rng(rng_seed).random((2 * count, arm.dof))
    q = arm.lower + (arm.upper - arm.lower) * shares[::2]
    return round_trips_of(space, q, seed_error * (2.0 * shares[1::2] - 1.0))


def round_trips_of(space: ArmSpace, q: Array, errors: Array) -> list[RoundTrip]:
    """Encode configurations q (N, n) [rad] and decode them from seeds that are off by errors (N, n) [rad]."""
    seeds = space.arm.within_limits(q + errors)
    decoded = space.decode_batch(np.array([space.encode(each) for each in q]), seeds)
    at_lower, at_upper = at_limits(space.arm, decoded.q)
    at_limit = np.any(at_lower | at_upper, axis=1)
    rows = zip(q, seeds, decoded.q, decoded.status, space.conditionings(q).tolist(), at_limit.tolist(), strict=True)
    return [RoundTrip(meant, seed, found, Status(status), *rest) for meant, seed, found, status, *rest in rows]
