"""The arms that er_il knows by name."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from pathlib import Path

from er_il.arms.gen3 import gen3_urdf
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
    weights: tuple[tuple[float, ...], ...]  # (n-6, n) of ERX: those of er_il.spaces.margin.workspace_weights


PANDA_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
PANDA_HOME = (0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4)

PRESETS = {
    "panda": Preset(
        partial(example_robot_data, "panda_description/urdf/panda.urdf"),
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=PANDA_JOINTS,
        home=PANDA_HOME,
        weights=((0.202, -0.0195, -0.6851, 0.0281, 0.693, 0.0148, -0.0908),),
    ),
    "panda8": Preset(
        panda8_urdf,
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=("panda_base_joint2", *PANDA_JOINTS),
        home=(0.0, *PANDA_HOME),
        weights=(
            (0.0078, -0.2858, 0.0109, -0.3111, 0.043, 0.8546, -0.0138, -0.2983),
            (0.0047, -0.6877, 0.0114, 0.7201, 0.0223, 0.0, -0.0074, -0.0881),
        ),
    ),
    "xarm7": Preset(
        partial(example_robot_data, "xarm_description/urdf/xarm7.urdf"),
        base_frame="link_base",
        ee_frame="link_eef",
        joints=tuple(f"joint{i}" for i in range(1, 8)),
        home=(0.0, -0.3, 0.0, 1.2, 0.0, 1.5, 0.0),
        weights=((-0.1582, 0.0125, 0.7125, 0.0001, -0.6772, 0.0368, 0.0852),),
    ),
    "gen3": Preset(
        gen3_urdf,
        base_frame="base_link",
        ee_frame="end_effector_link",
        joints=tuple(f"joint_{i}" for i in range(1, 8)),
        home=(0.0, 0.26, pi, -2.27, 0.0, 0.96, pi / 2),
        weights=((-0.1029, 0.0069, 0.6976, 0.0016, -0.6886, 0.0171, 0.1684),),
    ),
}
