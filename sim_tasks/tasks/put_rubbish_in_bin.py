"""Put Rubbish in Bin: drop a crumpled sheet of paper into a bin (paper V-A)."""

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from sim_tasks.tasks.object_task import WIDTH
from sim_tasks.tasks.placement import Placement, yawed
from sim_tasks.tasks.release_task import ReleaseTask
from sim_tasks.tasks.rewards import Reward, closeness
from sim_tasks.world.bin import Bin
from sim_tasks.world.randomisation import sides, span
from sim_tasks.world.rubbish import CRUMPLED_PAPER, PAPER_MIDDLE, TOMATO

RUBBISH, BIN, TOMATOES = "rubbish", "bin", ("tomato_1", "tomato_2")
THINGS = (RUBBISH, *TOMATOES)
DRAWS = 50  # of the things' places
APART = 0.12  # [m] between the things' middles, for the fingers to fit between
HIGH = 0.12  # [m] of the way's high point above the bin's rim
LOW = -0.03  # [m] of its low point
OVER = 0.03  # [m] from the bin's axis within which the rubbish is over the bin
LOWERED = 0.06  # [m] from the low point's height
BELOW = 0.005  # [m] below the rim from which the rubbish's middle is in the bin


class PutRubbishInBin(ReleaseTask):
    """The rubbish in the bin and out of the hand; two tomatoes stay where they are, but nothing judges them."""

    task = "put_rubbish_in_bin"
    task_description = "Put the crumpled paper into the bin."
    objects = (RUBBISH, BIN, *TOMATOES)
    graspable = THINGS
    bin = Bin()
    centre, bin_place = (0.45, -0.14), (0.42, 0.34)  # x, y [m] of the middles of their places
    reward = Reward(reach=0.0625, carry=0.25, lower=0.0625, open=0.25, success=0.375)

    def __init__(
        self,
        *,
        things_range: tuple[float, float] = (0.20, 0.30),
        bin_range: tuple[float, float] = (0.10, 0.10),
        bin_yaw_range: float = 0.5,
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            things_range: Sides [m] of the rectangle in which rubbish and tomatoes stand, ``APART`` from one another
                as far as it is large enough.
            bin_range: Sides [m] of the rectangle in which the bin stands.
            bin_yaw_range: The bin is turned up to this far [rad].
            kwargs: See :class:`sim_tasks.tasks.object_task.ObjectTask`.
        """
        self._things_range = sides("things_range", things_range)
        self._bin_range = sides("bin_range", bin_range)
        self._bin_yaw_range = span("bin_yaw_range", bin_yaw_range)
        super().__init__(**kwargs)

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.bin.add(spec, BIN, "steel")
        for name, thing in zip(THINGS, (CRUMPLED_PAPER, TOMATO, TOMATO), strict=True):
            thing.add(spec, name, (*self.centre, 0.0))

    def _draw(self, rng: np.random.Generator) -> Placement:
        # The best of a few draws: a range too small for three things is no endless loop.
        draws = [np.array(self.centre) + (rng.random((3, 2)) - 0.5) * self._things_range for _ in range(DRAWS)]
        places = next((draw for draw in draws if _closest(draw) >= APART), max(draws, key=_closest))
        turns = rng.uniform(-np.pi, np.pi, 3)
        placement: Placement = {
            name: (x, y, turn) for name, (x, y), turn in zip(THINGS, places.tolist(), turns.tolist(), strict=True)
        }
        x, y = np.array(self.bin_place) + (rng.random(2) - 0.5) * self._bin_range
        placement[BIN] = (x, y, rng.uniform(-self._bin_yaw_range, self._bin_yaw_range))
        return placement

    def _arrange(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self._put(name, (x, y, 0.0), yawed(yaw))

    @property
    def needed(self) -> tuple[str, ...]:
        return (RUBBISH,)

    @property
    def rubbish(self) -> Vector:
        """The rubbish's middle in the base frame (3,) [m]."""
        return self.point(RUBBISH, (0.0, 0.0, PAPER_MIDDLE))

    def above_rim(self, height: float) -> Vector:
        """The point in the base frame (3,) [m] on the bin's axis, a height [m] above the rim."""
        return self.point(BIN, (0.0, 0.0, self.bin.height + height))

    @property
    def ways(self) -> Mapping[str, Vector]:
        return {RUBBISH: self.rubbish - self.tip, BIN: self.above_rim(HIGH) - self.rubbish}

    def _in_place(self) -> bool:
        in_bin = self.rotation(BIN).T @ (self.rubbish - self.position(BIN))
        return self.bin.contains(in_bin.tolist(), BELOW)

    def _progress(self) -> dict[str, float]:
        if self._succeeds():
            return dict.fromkeys(("reach", "carry", "lower", "open"), 1.0)
        rubbish = self.rubbish
        carry = lower = opened = 0.0
        if self.held != RUBBISH:
            reach = self._reach_down(rubbish)
            return {"reach": reach, "carry": carry, "lower": lower, "open": opened}
        high, low = self.above_rim(HIGH), self.above_rim(LOW)
        if np.linalg.norm(rubbish[:2] - high[:2]) > OVER:
            carry = closeness(float(np.linalg.norm(rubbish - high)), WIDTH)
        else:
            carry, left, opened = 1.0, abs(float(rubbish[2] - low[2])), self.commanded_opening
            lower = 1.0 if left < LOWERED else closeness(left, WIDTH)
        return {"reach": 1.0, "carry": carry, "lower": lower, "open": opened}


def _closest(places: np.ndarray) -> float:
    """The smallest distance [m] between places (3, 2)."""
    return min(float(np.linalg.norm(one - other)) for one, other in combinations(places, 2))
