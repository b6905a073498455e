"""A gripper that carries."""

import mujoco

from sim_tasks.robot import FINGER_BODIES, GRIPPER

KP, KV = 5000.0, 60.0  # [N/m], [Ns/m]: some 20 N on a thin stem
CONTACT = (0.004, 1.0)  # [s] time constant, damping ratio: two time steps, the stiffest that is stable


def firm_grip(spec: mujoco.MjSpec) -> None:
    """Let a robot's gripper carry what it holds, not only lift it.

    Targets that step at 20 Hz make the hand start and stop; between soft contacts a thing held creeps a
    little each time, and is lost after some centimetres.
    """
    spec.actuator(GRIPPER).set_to_position(kp=KP, kv=KV)
    (coupling,) = spec.equalities
    coupling.solref, coupling.solimp[:2] = CONTACT, (0.99, 0.9999)
    for finger in FINGER_BODIES:
        for geom in spec.body(finger).geoms:
            geom.priority, geom.solref = 1, CONTACT
