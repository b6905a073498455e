"""Task space whose elbow keeps clear of the world: the strongest of the baselines.

It is given what no robot has, the true distances between the arm and everything around it. Where it does as well as an
action that commands the elbow, knowing the world replaces knowing the elbow.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from typing import Any

import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.self_motion import tangents, walk
from er_il.kinematics.solver import IkResult, Status
from er_il.spaces.base import ArmSpace, Array
from er_il.spaces.delta import PERIOD, DeltaSpace
from er_il.spaces.pose import PoseSpace

Clearances = Callable[[Vector, float], Vector]  # see :class:`er_il.envs.protocol.ClearanceEnv`

ENOUGH = 0.15  # [m] between a link and the world; more is not sought
STEEPNESS = 4.0  # [1] by which the cost of being near grows towards contact, so that near links count more
STRIDE, STRIDES = 0.25, 16  # [rad] over all joints between the looks at the self-motion, and how many each way
EFFORT = 0.01  # [1/rad] of cost that a way along the self-motion must save


@dataclass(frozen=True, eq=False)
class ClearSpace(PoseSpace):
    """Task space that slides along the arm's self-motion to where it is clear of the world.

    Of the configurations that have the action's pose it seeks the one with the least ``cost``, a potential as in
    Khatib's obstacle avoidance (1986): the sum over links of what each lacks of ``ENOUGH``. The sum, and not the
    smallest distance alone, because a link next to the hand may be near something wherever the elbow is. It looks along
    the self-motion, not only around the arm, whose gradient may lead into a corner; only ways without contact lead
    there, and the joints turn no farther in a decode than they can in ``PERIOD``. Clear by ``ENOUGH``, the arm takes
    the solution nearest the seed.
    """

    clearances: Clearances = field(kw_only=True)

    def solve(self, T_base_ee: Array, values: Vector, seed: Vector) -> IkResult:
        found = super().solve(T_base_ee, values, seed)
        if found.status is not Status.OK:
            return found
        target = self._within_reach(self._way(T_base_ee, found.q), seed)
        if target is found.q:
            return found
        slid = self.kinematics.solve(T_base_ee, target)
        return replace(slid, iters=found.iters + slid.iters) if slid.status is Status.OK else found

    def _way(self, T_base_ee: Array, start: Vector) -> list[Vector]:
        """Configurations (n,) [rad] from a start along the self-motion to the best of those looked at."""
        near = self.clearances(start, ENOUGH)
        chosen, least = [start], cost(near)
        if least == 0.0:
            return chosen
        contact = min(float(near.min()), 0.0)  # what touches already may go on touching
        for tangent in tangents(self.kinematics.jacobian(start)):
            way = [start]
            for q in islice(walk(self.kinematics, T_base_ee, start, tangent, STRIDE), STRIDES):
                near = self.clearances(q, ENOUGH)
                if near.min() < contact:
                    break
                way.append(q)
                total = cost(near) + EFFORT * STRIDE * (len(way) - 1)
                if total < least:
                    chosen, least = way.copy(), total
        return chosen

    def _within_reach(self, way: list[Vector], seed: Vector) -> Vector:
        """The end of a way, or how far along it the joints can turn from a seed (n,) [rad] in a period."""
        reach = self.arm.velocity * PERIOD
        for before, after in pairwise(way):
            turn = after - before
            room = np.where(turn > 0, seed + reach - before, before - seed + reach) / np.maximum(np.abs(turn), 1e-12)
            if (share := max(0.0, float(room.min()))) < 1.0:
                return before + share * turn
        return way[-1]

    def _solve_batch(self, actions: Any, seeds: Any) -> tuple[Any, Any]:
        return ArmSpace._solve_batch(self, actions, seeds)  # the elbow depends on the world: one by one


def cost(clearances: Vector) -> float:
    """What links lack of clearance: of each of (L,) distances [m], 0 from ``ENOUGH`` on, and 1 in contact."""
    lack = np.maximum(1.0 - clearances / ENOUGH, 0.0)
    return float(np.sum(np.expm1(STEEPNESS * lack)) / math.expm1(STEEPNESS))


def keeping_clear(space: ArmSpace, clearances: Clearances) -> ArmSpace:
    """Task space, or its changes, with an elbow that keeps clear of the world."""
    if isinstance(space, DeltaSpace):
        return replace(space, absolute=keeping_clear(space.absolute, clearances))
    assert isinstance(space, PoseSpace) and space.redundancy is None, "Only task space leaves the elbow open."
    return ClearSpace(space.arm, space.rotation, clearances=clearances)
