"""What the cup tasks share: a goblet to take by its stem."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.support.errors import PlanError
from sim_tasks.leader.collision import Collisions
from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe, Stretch, plan_stretch
from sim_tasks.tasks.arm_task import ArmTask, Placement
from sim_tasks.world.contact import touching
from sim_tasks.world.grip import firm_grip
from sim_tasks.world.props import Goblet
from sim_tasks.world.randomisation import SLOWEST, interval, sides, span

CUP = "cup"
GRASP_HEIGHT = 0.09  # [m] of the fingertips above the surface the cup stands on, at mid-stem
PITCH = np.radians(20)  # of the hand below the horizontal
FREED = 0.01  # [m] of the foot above the surface
TIPPED = np.cos(np.radians(25))  # cosine of the tilt from which a stemmed cup falls
CLOSED = 0.5  # opening below which the gripper counts as closed
CLEARANCE = 0.008  # [m] the leader keeps from the furniture
GRASP_TIME = 0.5  # [s] that the hand stays once the fingers are told to be closed
DRAWS = 10  # ways to the cup that the leader considers before it gives up
REST = 0.5  # [s] at the end, beyond the moment of success: a policy must not learn to stop short of it

# Offset [m] of the hand from the grasp, and base joint [rad] that puts the elbow there (or any).
Via = tuple[tuple[float, float, float], float | None]


class CupTask(ArmTask):
    """Reach the cup, grasp its thin stem and lift it free."""

    objects = (CUP,)
    cup = Goblet()
    surface: float  # z [m] on which the cup stands before a Panda
    centre: tuple[float, float]  # x, y [m] of the cup's mean place
    way: tuple[Via, ...]  # of the leader's hand to the grasp
    pace: float = 1.0  # of the hand on that way
    way_back: tuple[Via, ...]  # with the cup
    lean: float | None = None  # [rad] of the joints below the base joint, on an arm that has any (or any)

    def __init__(
        self,
        *,
        cup_range: tuple[float, float] = (0.03, 0.03),
        via_range: float = 0.01,
        sway_range: float = 0.0,
        speed_range: tuple[float, float] = (0.45, 0.55),
        closing_range: tuple[float, float] = (0.2, 0.6),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            cup_range: Sides [m] of the rectangle in which the cup stands.
            via_range: The leader's hand turns towards the cup up to this far [m] from the nominal place.
            sway_range: It passes the places between there and the grasp up to this far [m] beside them.
            speed_range: The leader's share of the joints' velocity limits.
            closing_range: Its fingers take so long [s] to close.
            kwargs: See :class:`ArmTask`.
        """
        self._cup_range = sides("cup_range", cup_range)
        self._via_range = span("via_range", via_range)
        self._sway_range = span("sway_range", sway_range)
        self._speed_range = interval("speed_range", speed_range, least=SLOWEST)
        self._closing_range = interval("closing_range", closing_range)
        super().__init__(**kwargs)
        self._cup_body = {self._model.body(CUP).id}
        self._was_freed = False

    @property
    def standing(self) -> float:
        """z [m] of the foot of the cup as it stands before this arm."""
        return self.surface + self.lift

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.cup.add(spec, CUP, (*self.centre, self.standing), "cobalt")
        firm_grip(spec)

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._cup_range
        return {CUP: (x, y, 0.0)}

    def _place(self, placement: Placement) -> None:
        x, y, yaw = placement[CUP]
        self._data.joint(CUP).qpos = (x, y, self.standing, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
        self._was_freed = False

    def _held(self) -> bool:
        return all(touching(self._model, self._data, {finger}, self._cup_body) for finger in self._fingers)

    def _freed(self) -> bool:
        return bool(self.object_pose(CUP)[2] > self.standing + FREED)

    def _upright(self) -> bool:
        return bool(self._data.body(CUP).xmat[8] > TIPPED)  # the cup's own z axis against the world's

    def _succeeds(self) -> bool:
        return self._held() and self._freed() and self._upright()

    def _fails(self) -> str:
        self._was_freed |= self._held() and self._freed()
        if not self._upright() or self.object_pose(CUP)[2] < self.standing - FREED:
            return "dropped" if self._was_freed else "knocked_over"
        return ""

    def _times_out(self) -> str:
        return "missed_grasp" if self.gripper_opening < CLOSED and not self._held() else "timeout"

    @cached_property
    def _collisions(self) -> Collisions:
        return Collisions(self._spec(), self.arm, self.obstacles, CLEARANCE)

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Stretch], float]:
        x, y = self.object_pose(CUP)[:2]
        grasp = np.array([x, y, self.standing + GRASP_HEIGHT])
        reach = self._reach(grasp, rng)
        back = [
            Keyframe(hand_pose(grasp + offset, PITCH), elbow, straight=True, lean=self.lean)
            for offset, elbow in self.way_back
        ]
        leave = plan_stretch(self.arm, reach[-1], back, self._collisions.is_free)
        speed, closing = rng.uniform(*self._speed_range), rng.uniform(*self._closing_range)
        script = [
            Stretch(reach, gripper=1.0, pace=self.pace),
            Stretch(reach[-1:], gripper=0.0, closing=closing, hold=closing + GRASP_TIME),
            Stretch(leave, gripper=0.0, hold=REST),
        ]
        return script, speed

    def _reach(self, grasp: Vector, rng: np.random.Generator) -> np.ndarray:
        """Waypoints (K, n) [rad] to a grasp (3,) [m], of the first way drawn that is clear of the furniture."""
        blocked = None
        for _ in range(DRAWS):
            off = np.zeros((len(self.way), 3))  # [m] from the nominal places
            off[0] = rng.uniform(-self._via_range, self._via_range, 3)
            off[1:-1, 1] = rng.uniform(-self._sway_range, self._sway_range, len(off) - 2)
            there = [
                Keyframe(hand_pose(grasp + offset + off[i], PITCH), elbow, straight=i > 0, lean=self.lean)
                for i, (offset, elbow) in enumerate(self.way)
            ]
            try:
                return plan_stretch(self.arm, self.joint_positions, there, self._collisions.is_free)
            except PlanError as error:
                blocked = error
        raise PlanError(f"None of {DRAWS} ways to the cup is free: {blocked}")
