"""What episodes amount to: counts, an exact interval, and the statuses of their decodes."""

from collections import Counter
from collections.abc import Sequence
from typing import Any, Protocol

from er_il.evaluation.statistics import exact_interval
from er_il.kinematics.solver import Status


class Outcome(Protocol):
    """An episode, a rollout's or a replay's."""

    @property
    def success(self) -> bool:
        """Whether it succeeded."""
        ...

    @property
    def failure(self) -> str:
        """What went wrong; "" after success."""
        ...

    @property
    def statuses(self) -> Counter[str]:
        """Statuses of decoding, one a step."""
        ...

    @property
    def joint_step(self) -> float:
        """Largest joint change [rad] that a decoded action asked for."""
        ...


def summarise(task: str, decoder: str, episodes: Sequence[Outcome]) -> dict[str, Any]:
    """Return what a report says of a task's episodes through a decoder, as JSON."""
    successes = sum(episode.success for episode in episodes)
    statuses = sum((episode.statuses for episode in episodes), Counter[str]())
    return {
        "task": task,
        "decoder": decoder,
        "successes": successes,
        "episodes": len(episodes),
        "interval": list(exact_interval(successes, len(episodes))),
        "failures": dict(Counter(episode.failure for episode in episodes if not episode.success).most_common()),
        "statuses": dict(statuses.most_common()),
        "invalid_rate": 1 - statuses[Status.OK] / statuses.total(),
        "max_joint_step": max(episode.joint_step for episode in episodes),
    }
