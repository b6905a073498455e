"""The rate at which actions come, against the one for which velocity limits are kept."""

import logging
import time

logger = logging.getLogger(__name__)

ACTIONS = 50  # after which their rate is known
FASTER = 1.2  # times the rate, beyond which it is told


class Pace:
    """Warns, once, that actions come faster than they are limited for: the arm would move faster by as much."""

    def __init__(self, rate: float) -> None:
        """Expect actions at a rate [Hz]."""
        self._rate = rate
        self._count = 0
        self._started = 0.0  # [s]

    def tick(self) -> None:
        """Count an action."""
        now = time.monotonic()
        if self._count == 0:
            self._started = now
        self._count += 1
        if self._count == ACTIONS + 1 and (rate := ACTIONS / (now - self._started)) > FASTER * self._rate:
            logger.warning(
                "Actions come at %.0f Hz, but velocities are limited for %g Hz: run the command with --fps=%g, or give "
                "--robot.fps.", rate, self._rate, self._rate
            )  # fmt: skip
