"""The guard before a robot's joints: what may be asked of them next."""

import numpy as np

from er_il.arms.arm import Vector


class JointGuard:
    """Keeps joint targets finite, within limits, and within the way that full speed allows from the last one."""

    def __init__(self, lower: Vector, upper: Vector, velocity: Vector) -> None:
        """Guard joints with position limits (n,) [rad] and a velocity limit (n,) [rad/s]."""
        self._lower, self._upper, self._velocity = lower, upper, velocity
        self._last: Vector | None = None

    def anchor(self, q: Vector) -> None:
        """Let the next target start from joint angles q (n,) [rad]."""
        self._last = np.array(q, dtype=np.float64)

    def target(self, wanted: Vector, passed: float) -> Vector:
        """The next target (n,) [rad] towards the wanted one (n,) [rad], ``passed`` seconds after the last.

        Too large a step is shortened in its direction; a wanted target that is not finite leaves the last standing.

        Raises:
            RuntimeError: :meth:`anchor` was never called.
        """
        last = self._anchored()
        if np.all(np.isfinite(wanted)):
            step = np.clip(wanted, self._lower, self._upper) - last
            share = np.max(np.abs(step) / self._velocity) / passed  # of the way that full speed allows
            last = self._last = last + step / max(1.0, float(share))
        return last

    def brake(self, q: Vector, rest: Vector) -> Vector:
        """The target (n,) [rad] at which an arm at q (n,) [rad] stops: where it can come to rest, or the last before.

        Raises:
            RuntimeError: :meth:`anchor` was never called.
        """
        last = self._anchored()
        self._last = np.clip(rest, np.minimum(q, last), np.maximum(q, last))
        return self._last

    def _anchored(self) -> Vector:
        if self._last is None:
            raise RuntimeError("JointGuard.anchor must be called before the first target.")
        return self._last
