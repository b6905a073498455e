"""Things that stand fast: what the arm has to keep clear of and cannot push away."""

from collections.abc import Sequence

import mujoco

from sim_tasks.world.household import Thing


def add_fixed(
    spec: mujoco.MjSpec, thing: Thing, name: str, position: Sequence[float] = (0.0, 0.0, 0.0)
) -> mujoco.MjsBody:
    """Add a thing without its free joint, at a position [m]."""
    body = thing.add(spec, name, position)
    spec.delete(spec.joint(name))
    return body
