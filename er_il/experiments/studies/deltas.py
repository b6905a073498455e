"""The study of deltas: whether a demonstration's changes, added up again by decoding, lead where it went."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm
from er_il.datasets.joint_path import JointPath
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.delta import PREFIX, DeltaSpace
from er_il.spaces.registry import SPACES, make_arm_space

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drift:
    """How far adding up the deltas of demonstrations led away from them, at worst."""

    space: str
    steps: int  # of all demonstrations
    longest: int  # steps of the longest
    invalid: int  # decodes that were not OK
    joints: float  # [rad] of a joint, at any step
    position: float  # [m] of the end effector
    rotation: float  # [rad]


def study_deltas(arm: Arm, demos: Mapping[str, Sequence[JointPath]]) -> dict[str, Any]:
    """Encode demonstrations as deltas and add them up by decoding, in every space; return it as JSON.

    Raises:
        BoundsError: a demonstration moves faster than the bounds that delta spaces declare.
        ArmError: an ER space does not suit the arm.
    """
    paths = [path.commanded for of_set in demos.values() for path in of_set]
    spaces = (make_arm_space(PREFIX + kind, arm) for kind in SPACES)
    return {"drifts": [vars(_drift(space, paths)) for space in spaces if isinstance(space, DeltaSpace)]}


def integrate(space: DeltaSpace, demo: Array) -> tuple[Array, int]:
    """Add up a demo's deltas: joints (T, n) [rad], and the number of decodes that were not OK.

    Each is decoded from the last command, as on a robot that follows.
    """
    path, invalid = [demo[0]], 0
    for action in space.encode(demo[1:], start=demo[0]):
        decoded = space.decode(action, path[-1], current=path[-1])
        invalid += decoded.status is not Status.OK
        path.append(decoded.q)
    return np.array(path), invalid


def _drift(space: DeltaSpace, demos: Sequence[Array]) -> Drift:
    kinematics, worst, invalid = kinematics_of(space.arm), np.zeros(3), 0
    for demo in demos:
        path, failed = integrate(space, demo)
        invalid += failed
        for T_base_ee, q in zip(kinematics.fk_batch(demo), path, strict=True):
            worst[1:] = np.maximum(worst[1:], kinematics.pose_error(T_base_ee, q))
        worst[0] = max(worst[0], np.abs(path - demo).max())
    lengths = [len(demo) for demo in demos]
    return Drift(space.absolute.kind, sum(lengths), max(lengths), invalid, *worst.tolist())
