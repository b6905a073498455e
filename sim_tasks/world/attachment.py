"""Rigid grasps: what both fingers touch when they close is welded to the hand until they open, as in RLBench."""

from collections.abc import Collection, Sequence

import mujoco
import numpy as np

from sim_tasks.world.contact import touches_shape, touching
from sim_tasks.world.household import grip_name
from sim_tasks.world.robot import HAND

CLOSED = 0.5  # opening below which the fingers are told to close
STIFF = (0.008, 1.0)  # [s] time constant, damping ratio: two time steps of 4 ms, the stiffest that is stable
RIGID = (0.99, 0.999, 0.001, 0.5, 2.0)  # impedance: a weld of the usual one gives way to the fingers' force


def add_attachments(spec: mujoco.MjSpec, bodies: Sequence[str]) -> None:
    """Prepare bodies to be attached to the hand; none is at first."""
    for body in bodies:
        weld = spec.add_equality(
            name=_weld(body), type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=HAND, name2=body
        )
        weld.active = False
        weld.solref, weld.solimp = STIFF, RIGID


class Attachment:
    """Attaches one body at a time to the hand of a compiled world, which :func:`add_attachments` prepared."""

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[str], fingers: Sequence[Collection[int]]) -> None:
        """Attach ``bodies`` when all of the groups of bodies ``fingers`` touch them, at their grip if they have one."""
        self._model = model
        self._fingers = fingers
        self._bodies = {name: (model.body(name).id, model.equality(_weld(name)).id) for name in bodies}
        grips = {name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, grip_name(name)) for name in bodies}
        self._grips = {name: geom for name, geom in grips.items() if geom >= 0}
        self._hand = model.body(HAND).id
        self.held = ""  # the body that is attached

    def forget(self) -> None:
        """Start an episode: MuJoCo has released everything."""
        self.held = ""

    def update(self, data: mujoco.MjData, opening: float) -> None:
        """Attach or release, given the opening in [0, 1] that the fingers are told to have."""
        if opening >= CLOSED:
            self._release(data)
        elif not self.held:
            for name in self._bodies:
                if all(self._touches(data, finger, name) for finger in self._fingers):
                    self._attach(data, name)
                    return

    def _touches(self, data: mujoco.MjData, finger: Collection[int], name: str) -> bool:
        if name in self._grips:
            return touches_shape(self._model, data, finger, self._grips[name])
        return touching(self._model, data, finger, {self._bodies[name][0]})

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


def _weld(body: str) -> str:
    return f"{body}_attached"
