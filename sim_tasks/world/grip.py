"""Grips: one that carries by friction, and one for things that are attached."""

from collections.abc import Sequence

import mujoco

from sim_tasks.world.robot import FINGER_BODIES, FINGER_KP, FINGERS, GRIPPER

KP, KV = 5000.0, 60.0  # [N/m], [Ns/m]: some 20 N on a thin stem
FINGER_ARMATURE = 0.1  # [kg] keeps such a stiff gripper stable without implicit damping
CONTACT = (0.004, 1.0)  # [s] time constant, damping ratio: two time steps, the stiffest that is stable


def firm_grip(spec: mujoco.MjSpec) -> None:
    """Let a robot carry what its gripper holds, not only lift it.

    Targets that step at 20 Hz make the hand start and stop, with its motors at their limits. Implicit
    integration then moves the arm less than the contacts were told, and what the fingers hold creeps out of
    them: 3 cm a metre, whatever the friction. Explicit integration has no such creep.
    """
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.actuator(GRIPPER).set_to_position(kp=KP, kv=KV)
    for finger in FINGERS:
        spec.joint(finger).armature = FINGER_ARMATURE
    for body in FINGER_BODIES:
        for geom in spec.body(body).geoms:
            geom.priority, geom.solref = 1, CONTACT


SLOW_KV = 150.0  # [Ns/m] closes the fingers at 0.2 m/s
SLOW_ARMATURE = 0.2  # [kg]
FIRM = (0.008, 1.0)  # [s] time constant, damping ratio: two time steps of 4 ms


def slow_grip(spec: mujoco.MjSpec, things: Sequence[str]) -> None:
    """Let fingers that are told to close at once stop at the free bodies ``things``, with time steps of 4 ms.

    Light and fast, they would pass into what is thin; and into soft, light things they would sink by a centimetre.
    """
    spec.actuator(GRIPPER).set_to_position(kp=FINGER_KP, kv=SLOW_KV)
    for finger in FINGERS:
        spec.joint(finger).armature = SLOW_ARMATURE
    for name in things:
        for geom in spec.body(name).geoms:
            geom.solref, geom.priority = FIRM, 1  # whatever touches it
