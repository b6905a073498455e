"""Retrieve Bear: take the bear from a cluttered cabinet top and touch nothing else (paper V-B).

A vase and a cactus stand at the front with a gap between them. The forearm that reaches the bear through
it fits only with the elbow up; swung out, it sweeps one of them down. Before that, while the hand
is drawn back above the gap, an elbow that points up leans into the wall behind the robot: it must
be swung out. No fixed habit of the elbow does both.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from sim_tasks.leader.collision import Collisions
from sim_tasks.leader.hand import hand_pose
from sim_tasks.leader.motion import Keyframe, Stretch, plan_stretch
from sim_tasks.tasks.arm_task import ArmTask, Placement
from sim_tasks.world.contact import touching
from sim_tasks.world.household import BEAR, BOOKS, CACTUS, HEAD_HEIGHT, LAMP, VASE, Sideboard, Thing
from sim_tasks.world.props import Wall
from sim_tasks.world.randomisation import SLOWEST, interval, sides, span

GAP = 0.36  # x [m] at which the leader's hand comes through between vase and cactus, always at y = 0
PITCH = np.radians(45)  # of the hand below the horizontal
LIFTED = 0.10  # [m] above the cabinet's top from which the bear is out of the clutter
FREED = 0.01  # [m] above the top
DISPLACED = 0.01  # [m] by which clutter may be pushed: a graze
TIPPED = np.cos(np.radians(15))  # cosine of the tilt of clutter beyond a graze
CLOSED = 0.3  # opening below which the gripper counts as closed
CLEARANCE = 0.012  # [m] the leader keeps from furniture and clutter
GRASP_TIME = 0.5  # [s] for the fingers to close
REST = 0.5  # [s] at the end, beyond the moment of success


class RetrieveBear(ArmTask):
    """Reach between tall things, grasp the bear by its head and lift it out."""

    task = "retrieve_bear"
    task_description = "Take the bear from the cluttered cabinet top without touching anything else."
    max_steps = 200
    things: Mapping[str, Thing] = {"bear": BEAR, "vase": VASE, "cactus": CACTUS, "books": BOOKS, "lamp": LAMP}
    places: Mapping[str, tuple[float, float]] = {
        "bear": (0.66, 0.0),
        "vase": (0.31, 0.205),
        "cactus": (0.31, -0.18),
        "books": (0.83, -0.12),
        "lamp": (0.82, 0.18),
    }  # x, y [m] of the mean places
    objects = tuple(things)
    clutter = objects[1:]
    obstacles = ("sideboard", "wall")
    sideboard = Sideboard()
    start = (1.30, -0.995, -0.317, -1.805, -0.940, 1.450, 1.418)  # above the gap, the elbow out
    # The way of the leader's hand: base joints [rad] that put the elbow out, half out and up.
    before = (0.38, 0.0, 0.66)  # [m] where the hand waits, whatever the bear's place: above the gap, the elbow out
    above = ((-0.12, 0.0, 0.13), 1.1)  # [m] from the grasp
    out = 1.2
    up = 0.3
    lifted = (-0.02, 0.0, 0.15)  # [m] from the grasp

    def __init__(
        self,
        *,
        bear_range: tuple[float, float] = (0.10, 0.065),
        clutter_range: tuple[float, float] = (0.03, 0.03),
        clutter_yaw_range: float = 0.2618,
        via_range: float = 0.01,
        speed_range: tuple[float, float] = (0.35, 0.42),
        **kwargs: Any,
    ) -> None:
        """Build the task.

        Args:
            bear_range: Sides [m] of the rectangle in which the bear sits.
            clutter_range: Sides [m] of the rectangle in which each other thing stands.
            clutter_yaw_range: Each other thing is turned up to this far [rad].
            via_range: The leader's hand turns towards the bear up to this far [m] from the nominal place.
            speed_range: The leader's share of the joints' velocity limits.
            kwargs: See :class:`ArmTask`.
        """
        self._bear_range = sides("bear_range", bear_range)
        self._clutter_range = sides("clutter_range", clutter_range)
        self._clutter_yaw_range = span("clutter_yaw_range", clutter_yaw_range)
        self._via_range = span("via_range", via_range)
        self._speed_range = interval("speed_range", speed_range, least=SLOWEST)
        super().__init__(**kwargs)
        self._bear_body = {self._model.body("bear").id}
        self._was_freed = False
        self._placed: dict[str, np.ndarray] = {}  # x, y [m] of each thing at the start

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.sideboard.add(spec, "sideboard", "wood", inner="dark_wood")
        Wall().add(spec, "wall", "plaster")
        for name, thing in self.things.items():
            thing.add(spec, name, (*self.places[name], self.sideboard.height))

    def _draw(self, rng: np.random.Generator) -> Placement:
        placement: Placement = {}
        for name, place in self.places.items():
            sides = self._clutter_range if name in self.clutter else self._bear_range
            x, y = np.array(place) + (rng.random(2) - 0.5) * sides
            turn = rng.uniform(-self._clutter_yaw_range, self._clutter_yaw_range) if name in self.clutter else 0.0
            placement[name] = (float(x), float(y), float(turn))
        return placement

    def _place(self, placement: Placement) -> None:
        for name, (x, y, yaw) in placement.items():
            self._data.joint(name).qpos = (x, y, self.sideboard.height, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
        self._placed = {name: np.array(place[:2]) for name, place in placement.items()}
        self._was_freed = False

    def _height(self) -> float:
        """Of the bear above the cabinet's top [m]."""
        return float(self.object_pose("bear")[2] - self.sideboard.height)

    def _fingers_on_bear(self) -> int:
        return sum(touching(self._model, self._data, {finger}, self._bear_body) for finger in self._fingers)

    def _succeeds(self) -> bool:
        return self._fingers_on_bear() == 2 and self._height() > LIFTED

    def _fails(self) -> str:
        for name in self.clutter:
            body = self._data.body(name)
            if body.xmat[8] < TIPPED:
                return "clutter_tipped"
            if np.linalg.norm(body.xpos[:2] - self._placed[name]) > DISPLACED:
                return "clutter_displaced"
        fingers = self._fingers_on_bear()
        self._was_freed |= fingers == 2 and self._height() > FREED
        return "dropped" if (self._was_freed and not fingers) or self._height() < -FREED else ""

    def _times_out(self) -> str:
        return "missed_grasp" if self.gripper_opening < CLOSED else "timeout"

    @cached_property
    def _collisions(self) -> Collisions:
        return Collisions(self._spec(), self.arm, (*self.obstacles, *self.clutter), CLEARANCE)

    def _script(self, rng: np.random.Generator) -> tuple[Sequence[Stretch], float]:
        grasp = self.object_pose("bear")[:3] + np.array([0.0, 0.0, HEAD_HEIGHT])
        yaw = float(np.arctan2(grasp[1], grasp[0] - GAP))
        along = Rotation.from_euler("z", yaw)
        turn = rng.uniform(-self._via_range, self._via_range, 3)
        offset, elbow = self.above
        there = [
            Keyframe(hand_pose(self.before + turn, PITCH), self.out),
            Keyframe(hand_pose(grasp + along.apply(offset), PITCH, yaw), elbow, straight=True),
            Keyframe(hand_pose(grasp, PITCH, yaw), self.up, straight=True),
        ]
        back = [Keyframe(hand_pose(grasp + along.apply(self.lifted), PITCH, yaw), self.up, straight=True)]
        self._collisions.place({name: self._data.joint(name).qpos for name in self.objects})
        is_free = self._collisions.is_free
        reach = plan_stretch(self.arm, self.joint_positions, there, is_free)
        leave = plan_stretch(self.arm, reach[-1], back, is_free)
        script = [
            Stretch(reach, gripper=1.0),
            Stretch(reach[-1:], gripper=0.0, hold=GRASP_TIME),
            Stretch(leave, gripper=0.0, hold=REST),
        ]
        return script, rng.uniform(*self._speed_range)
