"""The arms that er_il knows by name."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from pathlib import Path

from er_il.arms.fr3 import fr3_urdf
from er_il.arms.gen3 import gen3_urdf
from er_il.arms.openarm import (
    SIDES,
    TWIST,
    VERSIONS,
    WEIGHTS,
    hand_frame,
    openarm_home,
    openarm_joints,
    openarm_urdf,
)
from er_il.arms.panda8 import panda8_urdf
from er_il.arms.urdf import example_robot_data


@dataclass(frozen=True)
class Preset:
    """Arguments of :meth:`er_il.arms.arm.Arm.from_urdf` for a known arm."""

    urdf: Callable[[], Path]
    base_frame: str
    ee_frame: str
    joints: tuple[str, ...]
    home: tuple[float, ...]  # (n,) [rad] a comfortable posture
    weights: tuple[tuple[float, ...], ...]  # (n-6, n) of ERX: those of er_il.spaces.margin.home_weights
    redundant: tuple[str, ...] | None = None  # joints that ERJ commands; the first n-6 if None


PANDA_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
PANDA_HOME = (0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4)

PRESETS = {
    "panda": Preset(
        partial(example_robot_data, "panda_description/urdf/panda.urdf"),
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=PANDA_JOINTS,
        home=PANDA_HOME,
        weights=((0.7359, -0.0024, -0.4335, -0.0005, -0.3414, 0.003, 0.3923),),
    ),
    "fr3": Preset(
        fr3_urdf,
        base_frame="fr3_link0",
        ee_frame="fr3_hand_tcp",
        joints=tuple(f"fr3_joint{i}" for i in range(1, 8)),
        home=PANDA_HOME,
        weights=((0.7367, -0.0023, -0.4325, -0.0005, -0.3408, 0.003, 0.3924),),
    ),
    "panda8": Preset(
        panda8_urdf,
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=("panda_base_joint2", *PANDA_JOINTS),
        home=(0.0, *PANDA_HOME),
        weights=(
            (0.5152, 0.0013, -0.8183, -0.0065, -0.1543, 0.0048, -0.2027, -0.0022),
            (-0.001, 0.7541, 0.0, -0.3953, 0.0001, -0.3353, 0.0026, 0.4032),
        ),
    ),
    "xarm7": Preset(
        partial(example_robot_data, "xarm_description/urdf/xarm7.urdf"),
        base_frame="link_base",
        ee_frame="link_eef",
        joints=tuple(f"joint{i}" for i in range(1, 8)),
        home=(0.0, -0.3, 0.0, 1.2, 0.0, 1.5, 0.0),
        weights=((0.7872, -0.0041, -0.5484, -0.0008, -0.2143, -0.0044, 0.1835),),
    ),
    "gen3": Preset(
        gen3_urdf,
        base_frame="base_link",
        ee_frame="end_effector_link",
        joints=tuple(f"joint_{i}" for i in range(1, 8)),
        home=(0.0, 0.26, pi, -2.27, 0.0, 0.96, pi / 2),
        weights=((0.6961, 0.0155, -0.7061, 0.0177, -0.0303, 0.0071, 0.1237),),
    ),
}
PRESETS |= {
    f"openarm_{version}_{side}": Preset(
        partial(openarm_urdf, version, side),
        base_frame=own.base,
        ee_frame=hand_frame(side),
        joints=openarm_joints(side),
        home=openarm_home(side),
        redundant=(openarm_joints(side)[TWIST - 1],),
        weights=(WEIGHTS[version][side],),
    )
    for version, own in VERSIONS.items()
    for side in SIDES
}

# Robots with several arms: label of each arm -> its preset, in the order of the robot's vectors.
ROBOTS = {f"openarm_{version}": {side: f"openarm_{version}_{side}" for side in SIDES} for version in VERSIONS}
