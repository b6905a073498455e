"""The outcome of one rollout."""

from collections import Counter
from dataclasses import dataclass

from er_il.kinematics.solver import Status

FIRST_SEED = 1000  # LeRobot's own; demonstrations use seeds from a million up
TIMEOUT = "timeout"


@dataclass(frozen=True)
class Rollout:
    """One rollout."""

    seed: int
    success: bool
    failure: str  # "" after success
    statuses: Counter[str]  # of decoding, one a step
    latencies: tuple[float, ...]  # [s] of decoding, one a step
    joint_step: float  # [rad] largest joint change that a decoded action asked for
    elbow_error: float | None = None  # [m] see :class:`er_il.evaluation.elbow.ElbowReference`; None: not measured

    @property
    def steps(self) -> int:
        """Number of control steps."""
        return len(self.latencies)

    @property
    def invalid(self) -> int:
        """Number of actions whose status was not OK."""
        return self.steps - self.statuses[Status.OK]
