"""OpenArm, Enactic's open humanoid with two arms of seven joints, versions 1 and 2, by its published numbers.

Positions, axes and ranges are those of the descriptions that Enactic publishes under Apache-2.0:
``openarm_description`` 1.0 and ``openarm_mujoco`` (v1), ``openarm-mujoco`` 2.3.0 (v2). Speeds are the caps of
``openarm-control`` 0.5.0; the descriptions have the motors' own (16.8, 5.4 and 20.9 rad/s), which no arm should try.

Both arms hang straight down at zero, where all frames are parallel to the base's: x forward, y left, z up. The axes of
the shoulder, and those of the wrist, meet in a point. Link frames lie there, and not up to 38 mm along the same axes
as in version 1's description: that moves no end effector, and the arm angle needs the points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

from er_il.arms.chain import ChainJoint, Tool, Triple, chain_urdf
from er_il.arms.urdf import generated_urdf

SIDES = {"left": 1.0, "right": -1.0}  # sign of y
MOUNT = 0.031  # [m] from the base frame to each arm's first link
SHOULDER = (0.0625, 0.06)  # [m] sideways from there to the first joint, and on to the shoulder's centre
# [m] down from the shoulder to the upper arm's twist, the elbow, the forearm's twist and the wrist
DOWN = (0.06625, 0.15375, 0.0955, 0.1205)

# Lower and upper limit [rad] of each of the left arm's joints, and its speed [rad/s].
RANGES = (
    (-3.490659, 1.396263),
    (-3.316125, 0.174533),
    (-1.570796, 1.570796),
    (0.0, 2.443461),
    (-1.570796, 1.570796),
    (-0.785398, 0.785398),
    (-1.570796, 1.570796),
)
SPEEDS = (2.0, 2.0, 3.14, 3.14, 6.3, 6.3, 6.3)
MIRROR = (-1, -1, -1, 1, -1, -1, -1)  # signs that make of one arm's posture the other arm's mirrored one


@dataclass(frozen=True)
class Version:
    """What differs between the versions."""

    base: str  # link in which poses are expressed
    height: float  # [m] of the arms above it
    axes: tuple[Triple, ...]  # of the left arm's joints, in the base frame with the arm hanging
    turned: tuple[int, ...]  # joints whose axis points the other way on the right arm
    tool: Triple  # [m] of the point between the fingertips, in the wrist's frame


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def _minus(axis: Triple) -> Triple:
    x, y, z = axis
    return -x, -y, -z


_ARM = (Y, _minus(X), _minus(Z), _minus(Y), _minus(Z))  # up to the forearm's twist

VERSIONS = {
    # The base is the floor under the pedestal. The wrist bends sideways first.
    "v1": Version("openarm_body_link0", 0.698, (*_ARM, X, Y), (1, 7), (1e-6, 0.0045, -0.1801)),
    # The base lies between the arms, wherever they are mounted. No point between the fingertips is published; this is
    # the middle of their pads.
    "v2": Version("openarm_origin", 0.0, (*_ARM, _minus(Y), X), (1, 6), (0.0, 0.0, -0.1635)),
}
# The joint that ERJ commands: the upper arm's twist, which moves most in self-motion (`er-il advise openarm_v2_left`).
# The first joint, which the paper commands on a Panda, is near a singularity where an elbow hangs.
TWIST = 3
# Of ERX, by version and side: those of er_il.spaces.margin.home_weights.
WEIGHTS = {
    "v1": {
        "left": (-0.0081, 0.4692, -0.5296, 0.0, 0.5181, -0.4805, 0.0035),
        "right": (-0.0152, 0.4706, -0.5257, 0.0, 0.5193, -0.4818, -0.0024),
    },
    "v2": {
        "left": (-0.009, 0.4563, -0.5191, 0.0, 0.4936, -0.0013, -0.5279),
        "right": (-0.0146, 0.4631, -0.5198, 0.0, 0.4783, -0.0003, -0.5351),
    },
}
HOME = (0.0, -0.15, 0.0, pi / 2, 0.0, 0.0, 0.0)  # [rad] the left forearm held out forward


def openarm_urdf(version: str, side: str) -> Path:
    """Path of the generated URDF of one arm, written on first use to the folder for temporary files."""
    own, sign = VERSIONS[version], SIDES[side]
    outwards, (first, second) = sign * MOUNT, SHOULDER
    places: list[Triple] = [(0.0, outwards + sign * first, own.height), (0.0, sign * second, 0.0)]
    places += [(0.0, 0.0, -down) for down in DOWN] + [(0.0, 0.0, 0.0)]
    joints = [
        ChainJoint(
            name=f"openarm_{side}_joint{i}",
            link=f"openarm_{side}_link{i}",
            xyz=xyz,
            rpy=(0.0, 0.0, 0.0),
            range=_range(i, side),
            velocity=SPEEDS[i - 1],
            axis=_minus(axis) if side == "right" and i in own.turned else axis,
        )
        for i, (xyz, axis) in enumerate(zip(places, own.axes, strict=True), start=1)
    ]
    # As in version 1's description, z leaves the hand at its fingertips.
    tool = Tool(hand_frame(side), own.tool, (pi, 0.0, 0.0))
    return generated_urdf(chain_urdf(f"openarm_{version}_{side}", own.base, joints, tool), f"openarm_{version}.urdf")


def openarm_joints(side: str) -> tuple[str, ...]:
    """Names of an arm's joints, base first."""
    return tuple(f"openarm_{side}_joint{i}" for i in range(1, 8))


def hand_frame(side: str) -> str:
    """Name of the end-effector frame, between the fingertips."""
    return f"openarm_{side}_hand_tcp"


def openarm_home(side: str) -> tuple[float, ...]:
    """A comfortable posture (7,) [rad]."""
    return HOME if side == "left" else mirrored(HOME)


def mirrored(posture: Sequence[float]) -> tuple[float, ...]:
    """The other arm's posture (7,) [rad] that is the mirror image of one arm's."""
    return tuple(sign * angle for sign, angle in zip(MIRROR, posture, strict=True))


def _range(joint: int, side: str) -> tuple[float, float]:
    lower, upper = RANGES[joint - 1]
    return (-upper, -lower) if side == "right" and MIRROR[joint - 1] < 0 else (lower, upper)
