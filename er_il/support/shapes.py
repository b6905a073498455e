"""Shapes of a world, by which a viewer draws it without its simulator.

An environment describes itself by ``env.unwrapped.scene_geometry() -> Sequence[Shape]``, valid since
its last reset. An object ``cup`` that moves is followed through the environment state, whose names
then hold its pose in the arm's base frame: ``cup.x, cup.y, cup.z`` [m], ``cup.qx .. cup.qw``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POSE_NAMES = ("x", "y", "z", "qx", "qy", "qz", "qw")


@dataclass(frozen=True, eq=False)
class Shape:
    """One coloured solid; sizes are half extents, as in MuJoCo."""

    name: str
    kind: Literal["box", "sphere", "ellipsoid", "cylinder", "capsule", "mesh"]
    # [m] box, ellipsoid (x, y, z); sphere (radius,); cylinder, capsule (radius, half length along z)
    size: tuple[float, ...]
    rgba: tuple[float, float, float, float]  # in [0, 1]
    T_parent_shape: Array  # (4, 4)
    parent: str = ""  # object of the environment state that carries it; "": fixed to the arm's base
    vertices: Array | None = None  # (V, 3) [m], mesh only
    faces: NDArray[np.int64] | None = None  # (F, 3), mesh only


def object_poses(name: str, environment_state: Array, names: Sequence[str]) -> tuple[Array, Array] | None:
    """Position (T, 3) [m] and quaternion xyzw (T, 4) of an object, or None where the state does not hold its pose."""
    wanted = [f"{name}.{part}" for part in POSE_NAMES]
    if any(part not in names for part in wanted):
        return None
    poses = environment_state[:, [list(names).index(part) for part in wanted]]
    return poses[:, :3], poses[:, 3:]
