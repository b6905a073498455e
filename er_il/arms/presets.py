"""The arms that er_il knows by name."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import pi
from pathlib import Path

from er_il.arms.fr3 import fr3_urdf
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


PANDA_JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
PANDA_HOME = (0.0, -pi / 4, 0.0, -3 * pi / 4, 0.0, pi / 2, pi / 4)

PRESETS = {
    "panda": Preset(
        partial(example_robot_data, "panda_description/urdf/panda.urdf"),
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=PANDA_JOINTS,
        home=PANDA_HOME,
    ),
    "fr3": Preset(
        fr3_urdf,
        base_frame="fr3_link0",
        ee_frame="fr3_hand_tcp",
        joints=tuple(f"fr3_joint{i}" for i in range(1, 8)),
        home=PANDA_HOME,
    ),
    "panda8": Preset(
        panda8_urdf,
        base_frame="panda_link0",
        ee_frame="panda_hand_tcp",
        joints=("panda_base_joint2", *PANDA_JOINTS),
        home=(0.0, *PANDA_HOME),
    ),
    "xarm7": Preset(
        partial(example_robot_data, "xarm_description/urdf/xarm7.urdf"),
        base_frame="link_base",
        ee_frame="link_eef",
        joints=tuple(f"joint{i}" for i in range(1, 8)),
        home=(0.0, -0.3, 0.0, 1.2, 0.0, 1.5, 0.0),
    ),
    "gen3": Preset(
        gen3_urdf,
        base_frame="base_link",
        ee_frame="end_effector_link",
        joints=tuple(f"joint_{i}" for i in range(1, 8)),
        home=(0.0, 0.26, pi, -2.27, 0.0, 0.96, pi / 2),
    ),
}
