"""Round trips: decode(encode(q), seed near q) returns q, or the cause of the miss is determined."""

from dataclasses import dataclass

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.search import at_limits
from er_il.kinematics.solver import IkResult, Status
from er_il.spaces.base import ArmSpace

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
    decoded: IkResult
    conditioning: float  # at q, see Kinematics.conditioning; infinite in joint space
    at_limit: bool  # a decoded joint is at its limit

    @property
    def exact(self) -> bool:
        """True if the configuration came back."""
        return float(np.abs(self.decoded.q - self.q).max()) <= EXACT

    @property
    def cause(self) -> str:
        """Cause of a miss, one of ``CAUSES``; "" if the configuration came back."""
        if self.exact:
            return ""
        if self.at_limit or self.decoded.status is Status.LIMIT:
            return LIMIT
        if self.ambiguous:
            return AMBIGUOUS
        if self.conditioning < SINGULAR:
            return ILL_CONDITIONED
        return UNEXPLAINED if self.decoded.status is Status.OK else REPORTED

    @property
    def ambiguous(self) -> bool:
        """True if another solution is as good and nearer the seed: action and seed cannot tell which was meant."""
        nearer = np.linalg.norm(self.decoded.q - self.seed) <= np.linalg.norm(self.q - self.seed)
        return self.decoded.status is Status.OK and not self.exact and bool(nearer)


def round_trips(space: ArmSpace, count: int, *, seed_error: float = 0.1, rng_seed: int = 0) -> list[RoundTrip]:
    """Sample configurations uniformly within the limits, and seeds within ``seed_error`` [rad] of each joint."""
    arm, rng = space.arm, np.random.default_rng(rng_seed)
    return [round_trip(space, rng.uniform(arm.lower, arm.upper), seed_error, rng) for _ in range(count)]


def round_trip(space: ArmSpace, q: Vector, seed_error: float, rng: np.random.Generator) -> RoundTrip:
    """Encode a configuration (n,) [rad] and decode it from a seed within ``seed_error`` [rad] of each joint."""
    arm = space.arm
    seed = arm.within_limits(q + rng.uniform(-seed_error, seed_error, arm.dof))
    action = space.encode(q)
    decoded = space.decode(action, seed)
    return RoundTrip(q, seed, decoded, space.conditioning(q), bool(np.any(at_limits(arm, decoded.q))))
