"""The base of every scripted leader: planning with random draws, then playing the plan."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np

from er_il.arms.arm import Vector
from er_il.support.errors import PlanError
from sim_tasks.leader.arm import LeaderArm
from sim_tasks.leader.motion import Segment
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.robot_task import RobotTask
from sim_tasks.world.randomisation import SLOWEST, interval, span

REST = 0.5  # [s] at the end, beyond the moment of success: a policy must not learn to stop short of it
DRAWS = 10  # random plans that are tried before the leader gives up

_STREAM = 2  # separates the leader's random numbers from the world's, which are seeded with the seed itself


class Performer(Protocol):
    """A simulated leader robot, which plays scripts."""

    def perform(self, start: Vector, script: Sequence[Segment], speed: float) -> Iterator[np.ndarray]:
        """Play a script from joint angles [rad]; yield what the follower is told each period."""
        ...


class RobotLeader[Task: RobotTask](ABC):
    """Demonstrates the episodes of one world. Subclasses bring the leading robot and write the script."""

    def __init__(
        self, world: Task, *, via_range: float = 0.01, speed_range: tuple[float, float] = (0.45, 0.55)
    ) -> None:
        """Prepare to demonstrate in ``world``.

        Args:
            world: The task's environment, whose state is read.
            via_range: The first via point of the hand is displaced by up to this much [m] along each axis.
            speed_range: Share of the joints' velocity limits.

        Raises:
            RandomisationError: a range is invalid.
        """
        self._via_range = span("via_range", via_range)
        self._speed_range = interval("speed_range", speed_range, least=SLOWEST)
        self._world = world
        self._performer = self._leading()

    @abstractmethod
    def _leading(self) -> Performer:
        """The robot that leads."""

    def demonstrate(self, seed: int) -> Iterator[np.ndarray]:
        """Plan a demonstration of the episode just reset, and play it.

        Yields the leader's joint angles [rad] and gripper opening, (n+1,) float64 each control period; of each arm.

        Raises:
            PlanError: none of the random plans is feasible; known before the first yield.
        """
        script, speed = self._plan(np.random.default_rng([seed, _STREAM]))
        return self._performer.perform(self._world.joint_positions, script, speed)

    def _plan(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        """The first feasible script; the next one is written with the random numbers that follow."""
        blocked = None
        for _ in range(DRAWS):
            try:
                return self._script(rng)
            except PlanError as error:
                blocked = error
        raise PlanError(f"None of {DRAWS} plans is feasible. The last: {blocked}")

    @abstractmethod
    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        """Plan the segments of a demonstration and the share of the velocity limits.

        Raises:
            PlanError: the plan is not feasible with these random numbers.
        """

    def _draw_via(self, rng: np.random.Generator) -> np.ndarray:
        """Displacement (3,) [m] of the first via point."""
        return rng.uniform(-self._via_range, self._via_range, 3)

    def _draw_speed(self, rng: np.random.Generator) -> float:
        return rng.uniform(*self._speed_range)


class Leader[Task: ArmTask](RobotLeader[Task]):
    """Demonstrates with one arm."""

    def _leading(self) -> LeaderArm:
        return LeaderArm(self._world.arm, 1 / self._world.rate)
