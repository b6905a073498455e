"""Dense rewards made of named terms."""

import math
from collections.abc import Mapping

from er_il.arms.arm import Vector

SUCCESS = "success"
KERNELS = (4.0, 1.0, 0.2)  # widths of closeness, in parts of its own
CLEARANCE = 0.1  # [m] above a place, from which a thing comes down to it


class Reward:
    """A weighted sum of stages of a task, each with a progress in [0, 1], and of success.

    The weights sum to 1, so the reward is in [0, 1]. Since success has a weight of its own, the reward reaches
    1 only in a state that is a success, and there every stage must be complete.
    """

    def __init__(self, **weights: float) -> None:
        """Declare the weights of the stages in the order in which they are passed, ``success`` among them."""
        if SUCCESS not in weights or min(weights.values()) <= 0 or math.fsum(weights.values()) != 1.0:
            raise ValueError(f"Weights must be positive, sum to 1 and include {SUCCESS!r}: {weights}.")
        self.weights = weights

    def terms(self, progress: Mapping[str, float], success: bool) -> dict[str, float]:
        """Terms of the reward by name, which sum to it; ``progress`` holds that of each stage."""
        complete = dict(progress) | {SUCCESS: float(success)}
        return {name: weight * min(max(complete[name], 0.0), 1.0) for name, weight in self.weights.items()}


def total(terms: Mapping[str, float]) -> float:
    """The reward: the sum of its terms, rounded once."""
    return math.fsum(terms.values())


def proximity(distance: float, width: float) -> float:
    """Closeness in (0, 1] at a distance [m]: exp(-distance / width), 1 if the distance is not positive."""
    return math.exp(-max(distance, 0.0) / width)


def closeness(distance: float, width: float) -> float:
    """Closeness in (0, 1] at a distance [m or rad]: the mean of three kernels, to set out, to come near and to arrive.

    The widest, for distances the paper's, is flat near the goal, the narrowest far from it: alone, neither would tell
    of the last centimetres, which decide a grasp, or of the way across the bench.
    """
    return math.fsum(proximity(distance, width * share) for share in KERNELS) / len(KERNELS)


def share(left: float, whole: float) -> float:
    """Share in [0, 1] of a way that is done: every step of it earns the same. Lengths in [m], or angles in [rad]."""
    return min(max(1.0 - left / whole, 0.0), 1.0)


def way_down(left: Vector) -> float:
    """Length [m] of the way to a place that a thing comes to from above, given the vector to it (3,) [m].

    Across, and up or down to a cone over the place, which rises by 45 degrees up to ``CLEARANCE``. Along a straight way
    a thing on the bench would be pressed against the furniture that the place is on.
    """
    across = math.hypot(left[0], left[1])
    return across + abs(-left[2] - min(across, CLEARANCE))
