"""The scripts that are lists of moves: keyframes of the hand, and what the fingers do."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from sim_tasks.leader.collision import Collisions
from sim_tasks.leader.leader import REST, Leader
from sim_tasks.leader.motion import Keyframe, Segment, plan_path
from sim_tasks.tasks.object_task import ObjectTask

ACT_TIME = 0.4  # [s] that the hand rests while the fingers open or close


@dataclass(frozen=True)
class Move:
    """A motion through keyframes with the fingers at an opening, which they take before the hand moves."""

    keyframes: Sequence[Keyframe]  # none: only the fingers move
    opening: float  # in [0, 1]
    pace: float = 1.0  # share of the script's speed
    hold: float = 0.0  # [s] rest at the end


class MovesLeader[Task: ObjectTask](Leader[Task]):
    """Plays moves, planned from the state at the start of the episode."""

    avoid: ClassVar[tuple[str, ...]] = ()  # bodies that the plan must not touch
    clearance: ClassVar[float] = 0.005  # [m] that it keeps from them

    @abstractmethod
    def _moves(self, rng: np.random.Generator) -> Sequence[Move]:
        """The moves of one demonstration."""

    @cached_property
    def _collisions(self) -> Collisions:
        return Collisions.of_arm(self._world.world_spec(), self._world.arm, self.avoid, self.clearance)

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Segment], float]:
        world, moves = self._world, self._moves(rng)
        self._collisions.copy(world.data)
        q, opening = world.joint_positions, 1.0
        script: list[Segment] = []
        for move in moves:
            if move.opening != opening:
                opening = move.opening
                script.append(Segment(q[None], gripper=opening, hold=ACT_TIME))
            if move.keyframes:
                path = plan_path(world.arm, q, move.keyframes, self._collisions.is_free)
                script.append(Segment(path, gripper=opening, hold=move.hold, pace=move.pace))
                q = path[-1]
        script.append(Segment(q[None], gripper=opening, hold=REST))
        return script, self._draw_speed(rng)
