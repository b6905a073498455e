"""Rigid grasps: what is between the fingers when they close is welded to the hand until they open, as in RLBench.

There, a proximity sensor in the hand detects it. Here it is what is near the point between the fingertips as they begin
to close, or what both of them touch.
"""

from collections.abc import Collection, Sequence

import mujoco
import numpy as np

from sim_tasks.world.contact import collision_geoms, distance, touches_shapes
from sim_tasks.world.household import grip_name
from sim_tasks.world.props import SPHERE
from sim_tasks.world.robot import HAND, TIP

SENSOR = "proximity_sensor"
RANGE = 0.02  # [m] around the point between the fingertips, half as far as each of them, in which a thing is detected
CLOSED = 0.5  # opening below which the fingers are told to close
STIFF = (0.008, 1.0)  # [s] time constant, damping ratio: two time steps of 4 ms, the stiffest that is stable
RIGID = (0.99, 0.999, 0.001, 0.5, 2.0)  # impedance: a weld of the usual one gives way to the fingers' force


def add_attachments(spec: mujoco.MjSpec, bodies: Sequence[str]) -> None:
    """Prepare bodies to be attached to the hand, which gets a sensor; none is at first."""
    if bodies:
        unseen = {"contype": 0, "conaffinity": 0, "group": 4, "mass": 0}
        spec.body(TIP).add_geom(name=SENSOR, type=SPHERE, size=(RANGE, 0, 0), **unseen)
    for body in bodies:
        weld = spec.add_equality(
            name=_weld(body), type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=HAND, name2=body
        )
        weld.active = False
        weld.solref, weld.solimp = STIFF, RIGID


class Attachment:
    """Attaches one body at a time to the hand of a compiled world, which :func:`add_attachments` prepared."""

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[str], fingers: Sequence[Collection[int]]) -> None:
        """Attach ``bodies``, at their grip if they have one.

        Args:
            model: The world.
            bodies: Names of free bodies.
            fingers: Ids of each finger's bodies.
        """
        self._model = model
        self._fingers = fingers
        self._bodies = {name: (model.body(name).id, model.equality(_weld(name)).id) for name in bodies}
        self._shapes = {name: _graspable_shapes(model, name) for name in bodies}
        self._sensor = model.geom(SENSOR).id if bodies else -1
        self._hand = model.body(HAND).id
        self.forget()

    def forget(self) -> None:
        """Start an episode: MuJoCo has released everything."""
        self.held = ""  # the body that is attached
        self._was_open = True  # told to be

    def update(self, data: mujoco.MjData, opening: float) -> None:
        """Attach or release, given the opening in [0, 1] that the fingers are told to have."""
        if is_open(opening):
            self._release(data)
        elif not self.held:
            found = self._detected if self._was_open else self._touched
            if name := next((name for name in self._bodies if found(data, name)), ""):
                self._attach(data, name)
        self._was_open = is_open(opening)

    def _detected(self, data: mujoco.MjData, name: str) -> bool:
        return distance(self._model, data, (self._sensor,), self._shapes[name]) <= 0.0

    def _touched(self, data: mujoco.MjData, name: str) -> bool:
        return all(touches_shapes(self._model, data, finger, self._shapes[name]) for finger in self._fingers)

    def _attach(self, data: mujoco.MjData, name: str) -> None:
        body, weld = self._bodies[name]
        R_world_hand = data.xmat[self._hand].reshape(3, 3)
        turn, hand_to_world = np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(hand_to_world, data.xquat[self._hand])
        mujoco.mju_mulQuat(turn, hand_to_world, data.xquat[body])
        # anchor in the body's frame, pose of the body in the hand's frame, share of the torque
        pose = self._model.eq_data[weld]
        pose[:3] = 0.0
        pose[3:6] = R_world_hand.T @ (data.xpos[body] - data.xpos[self._hand])
        pose[6:10], pose[10] = turn, 1.0
        data.eq_active[weld] = 1
        self.held = name

    def _release(self, data: mujoco.MjData) -> None:
        if self.held:
            data.eq_active[self._bodies[self.held][1]] = 0
            self.held = ""


def is_open(opening: float) -> bool:
    """True if fingers told to have an opening in [0, 1] let go, false if they close."""
    return opening >= CLOSED


def _graspable_shapes(model: mujoco.MjModel, name: str) -> tuple[int, ...]:
    grip = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, grip_name(name))
    return (grip,) if grip >= 0 else collision_geoms(model, {model.body(name).id})


def _weld(body: str) -> str:
    return f"{body}_attached"
