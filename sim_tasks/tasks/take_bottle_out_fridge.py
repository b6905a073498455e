"""Take Bottle Out Fridge: the arm itself opens the door while the hand holds the bottle still (paper V-A).

The hand starts at a bottle inside a fridge, whose door presses shut on the forearm. The forearm must push it open, past
a catch, before the bottle may move; the pose of a hand that stays where it is says nothing of that.
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from er_il.arms.arm import Vector
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import Status, kinematics_of
from sim_tasks.tasks.object_task import TURN_WIDTH, WIDTH, ObjectTask
from sim_tasks.tasks.placement import Area, Placement, yawed
from sim_tasks.tasks.rewards import Reward, closeness, share
from sim_tasks.world.contact import touching
from sim_tasks.world.fridge import Fridge
from sim_tasks.world.props import SPHERE
from sim_tasks.world.randomisation import sides
from sim_tasks.world.tableware import bottle

BOTTLE, FRIDGE, DOOR = "bottle", "fridge", "door"
OPEN = np.radians(45)  # of the door, from which it stays open
STILL = 0.025  # [m] by which the bottle may move before
NECK, AHEAD = 0.20, 0.012  # [m] height on the bottle at which the hand starts, distance of its axis before the tip
MARK = (0.48, 0.00, 0.38)  # [m] outside, beyond the swing of the door
OUTSIDE = 0.56  # x [m] before the fridge, from where nothing is between the bottle and the mark
TAKEN = 0.06  # [m] from the mark
WIDEST, CLOSE = np.radians(90), 0.005  # [rad] opening from which the door falls onto the arm at the start, to within


class TakeBottleOutFridge(ObjectTask):
    """Hold the bottle still, open the door with the forearm, then pull the bottle out."""

    task = "take_bottle_out_fridge"
    task_description = "Push the fridge's door open with the arm and take the bottle out."
    fridge = Fridge()
    objects = (BOTTLE, DOOR)
    graspable = (BOTTLE,)
    centre = (0.77, 0.33)  # x, y [m] of the bottle's mean place
    area = Area.around((fridge.front + fridge.depth / 2, fridge.side), (fridge.depth - 0.08, fridge.inner_width - 0.08))
    start = (0.06, 0.65, 0.40, -1.46, -0.88, 2.88, 1.50)  # the hand at the bottle, the elbow a little to the right
    reward = Reward(grasp=0.0625, door=0.125, pull=0.1875, out=0.25, success=0.375)

    def __init__(self, *, bottle_range: tuple[float, float] = (0.05, 0.04), **kwargs: Any) -> None:
        """Build the task.

        Args:
            bottle_range: Sides [m] of the rectangle in which the bottle stands; the hand starts at it.
            kwargs: See :class:`ObjectTask`.
        """
        self._bottle_range = sides("bottle_range", bottle_range)
        super().__init__(**kwargs)
        self._hinge = self.model.joint(DOOR)
        self._spring = float(self._hinge.stiffness[0])
        self._door = {self.model.body(DOOR).id}
        self.mark = np.array(MARK)  # [m] to which the bottle's neck is to come
        self._place_of_bottle: Vector = np.zeros(3)  # [m] in this episode
        self.opened = False  # the catch holds the door open

    def _build(self, spec: mujoco.MjSpec) -> None:
        self.fridge.add(spec, FRIDGE, DOOR)
        bottle().add(spec, BOTTLE, (*self.centre, self.fridge.floor))
        spec.worldbody.add_geom(
            type=SPHERE, size=(TAKEN, 0, 0), pos=MARK, rgba=(0.15, 0.65, 0.2, 0.25), contype=0, conaffinity=0, group=2
        )

    def _draw(self, rng: np.random.Generator) -> Placement:
        x, y = np.array(self.centre) + (rng.random(2) - 0.5) * self._bottle_range
        return {BOTTLE: (x, y, 0.0)}

    def _arrange(self, placement: Placement) -> None:
        x, y, yaw = placement[BOTTLE]
        self._put(BOTTLE, (x, y, self.fridge.floor + 0.001), yawed(yaw))
        self._place_of_bottle = np.array(self.data.joint(BOTTLE).qpos[:3])
        self._reach_in()
        self.opened = False
        self._hinge.range[0], self._hinge.stiffness[0] = 0.0, self._spring
        self._close_door()

    def _reach_in(self) -> None:
        """Move the hand to the bottle, the base joint left where it is; leave the arm where that is out of reach."""
        q, arm = self.joint_positions, self.arm
        T_base_hand = kinematics_of(arm).fk(q)
        T_base_hand[:3, 3] = self._place_of_bottle + np.array([0.0, 0.0, NECK]) - AHEAD * T_base_hand[:3, 2]
        held = [q[arm.joints.index(joint)] for joint in arm.redundant]
        ik = kinematics_of(arm).solve(T_base_hand, q, JointAngle(arm, arm.redundant), held)
        if ik.status is Status.OK:
            self.robot.place(self.data, ik.q.round(9), 1.0)  # its last bits differ from machine to machine

    def _close_door(self) -> None:
        """Let the door lean on the arm, from wide open."""
        shut, free = 0.0, WIDEST
        while free - shut > CLOSE:
            self.data.joint(DOOR).qpos = middle = (shut + free) / 2
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            mujoco.mj_collision(self.model, self.data)
            if touching(self.model, self.data, self.robot.bodies, self._door):
                shut = middle
            else:
                free = middle
        self.data.joint(DOOR).qpos = free

    @property
    def ways(self) -> Mapping[str, Vector]:
        moved = np.zeros(3) if self.opened else self.position(BOTTLE) - self._place_of_bottle  # as far as it matters
        return {BOTTLE: self._neck - self.tip, "place": -moved, "mark": self.mark - self._neck}

    @property
    def directions(self) -> Mapping[str, Vector]:
        return {DOOR: self.rotation(DOOR)[:, 0]}

    @property
    def touched(self) -> tuple[str, ...]:
        return (*super().touched, DOOR)

    @property
    def door_angle(self) -> float:
        """Opening [rad] of the door; 0 is shut."""
        return float(self.data.joint(DOOR).qpos[0])

    def _grip(self, opening: float) -> None:
        super()._grip(opening)
        if not self.opened and self.grasped and self._still() and self.door_angle >= OPEN:
            self.opened = True
            self._hinge.range[0], self._hinge.stiffness[0] = OPEN, 0.0

    def _still(self) -> bool:
        return self._moved() <= STILL

    def _moved(self) -> float:
        """Distance [m] of the bottle from where it stood."""
        return float(np.linalg.norm(self.position(BOTTLE) - self._place_of_bottle))

    def _distance(self) -> float:
        """Distance [m] of the bottle's neck from the mark."""
        return float(np.linalg.norm(self._neck - self.mark))

    def _pulled(self) -> float:
        """Share of the way straight out of the fridge that the bottle's neck has made, at most 1."""
        inside, whole = (float(place) - OUTSIDE for place in (self._neck[0], self._place_of_bottle[0]))
        return share(inside, whole)

    def _carried(self) -> float:
        """Share of the way on to the mark that it has made, from where it comes out; 0 while it is inside."""
        _, y, z = self._place_of_bottle
        whole = float(np.linalg.norm(self.mark - (OUTSIDE, y, z + NECK)))
        return share(self._distance(), whole) if self._pulled() == 1.0 else 0.0

    @property
    def _neck(self) -> Vector:
        return self.point(BOTTLE, (0.0, 0.0, NECK))

    def _succeeds(self) -> bool:
        return self.grasped and self.opened and self._distance() <= TAKEN

    def _progress(self) -> dict[str, float]:
        done = dict.fromkeys(self.reward.weights, 0.0)
        if not self.grasped:
            return done
        if not self.opened:
            still = closeness(self._moved() - STILL, WIDTH)
            return done | {"grasp": 1.0, "door": still * closeness(OPEN - self.door_angle, TURN_WIDTH)}
        if self._distance() <= TAKEN:
            return dict.fromkeys(done, 1.0)
        return done | {"grasp": 1.0, "door": 1.0, "pull": self._pulled(), "out": self._carried()}
