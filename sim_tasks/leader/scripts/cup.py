"""The scripts of the cup tasks."""

from typing import Any, ClassVar

import numpy as np

from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe
from sim_tasks.leader.scripts.pick import PickLeader
from sim_tasks.tasks.cup_task import CupTask
from sim_tasks.world.randomisation import interval, span

PITCH = np.radians(20)  # of the hand below the horizontal

# Offset [m] of the hand from the grasp, and desired angle [rad] of the base joint (None: any), which sets the elbow.
ViaPoint = tuple[tuple[float, float, float], float | None]


class CupLeader(PickLeader[CupTask]):
    """Takes a cup by its stem."""

    clearance = 0.008
    approach: ClassVar[tuple[ViaPoint, ...]]  # the last one is the grasp
    retreat: ClassVar[tuple[ViaPoint, ...]]
    lean: ClassVar[float | None] = None  # [rad] of the joints below the base joint, on an arm with any (None: any)

    def __init__(
        self,
        world: CupTask,
        *,
        sway_range: float = 0.0,
        closing_range: tuple[float, float] = (0.2, 0.6),
        **kwargs: Any,
    ) -> None:
        """Prepare to demonstrate in ``world``.

        Args:
            world: The task's environment.
            sway_range: Intermediate via points are displaced sideways by up to this much [m].
            closing_range: Duration [s] of closing the gripper.
            kwargs: See :class:`sim_tasks.leader.leader.Leader`.
        """
        self._sway_range = span("sway_range", sway_range)
        self._closing_range = interval("closing_range", closing_range)
        super().__init__(world, **kwargs)

    def _keyframes(self, rng: np.random.Generator) -> tuple[list[Keyframe], list[Keyframe]]:
        x, y = self._world.object_pose(self._world.target)[:2]
        grasp = np.array([x, y, self._world.support + self._world.grasp_height])
        displacement = np.zeros((len(self.approach), 3))  # [m]
        displacement[0] = self._draw_via(rng)
        displacement[1:-1, 1] = rng.uniform(-self._sway_range, self._sway_range, len(displacement) - 2)
        approach = [
            Keyframe(hand_pose(grasp + offset + displacement[i], PITCH), elbow, straight=i > 0, lean=self.lean)
            for i, (offset, elbow) in enumerate(self.approach)
        ]
        retreat = [
            Keyframe(hand_pose(grasp + offset, PITCH), elbow, straight=True, lean=self.lean)
            for offset, elbow in self.retreat
        ]
        return approach, retreat

    def _draw_closing(self, rng: np.random.Generator) -> float:
        return rng.uniform(*self._closing_range)


class LiftCupLeader(CupLeader):
    """Any elbow will do."""

    approach = (
        ((-0.20, 0.0, 0.04), None),
        ((-0.10, 0.0, 0.01), None),
        ((0.003, 0.0, 0.0), None),  # the stem in the middle of the finger pads
    )
    retreat = (((-0.03, 0.0, 0.025), None),)  # lifted
    lean = 0.2


class ReachCupLeader(CupLeader):
    """The elbow comes up while the hand is in the opening."""

    approach = (
        ((-0.34, 0.0, 0.04), 1.2),  # down before the opening, the elbow out, clear of the wall
        ((-0.24, 0.0, 0.02), 1.15),
        ((-0.10, 0.0, 0.01), 0.1),  # the elbow comes up while the forearm is still outside
        ((0.003, 0.0, 0.0), 0.1),  # the stem in the middle of the finger pads
    )
    retreat = (((-0.03, 0.0, 0.025), 0.1),)  # lifted


class RemoveCupLeader(CupLeader):
    """The elbow swings out on the way out."""

    approach_pace = 0.5  # else the grasp is over in half a second, too few frames to learn it from
    approach = (
        ((-0.04, 0.0, 0.012), 0.1),  # no lower: the wrist would touch the floor of the compartment
        ((0.003, 0.0, 0.0), 0.1),  # the stem in the middle of the finger pads
    )
    retreat = (
        ((-0.03, 0.0, 0.025), 0.1),  # lifted
        ((-0.10, 0.0, 0.03), 0.1),
        ((-0.24, 0.0, 0.03), 1.15),  # the elbow swings out before it leans back into the wall
        ((-0.39, 0.0, 0.04), 1.3),  # farther than success asks, so that a policy passes its border
    )
    lean = 0.1


class ReachRemoveCupLeader(RemoveCupLeader):
    """Both in one."""

    approach = ReachCupLeader.approach
    approach_pace = ReachCupLeader.approach_pace
