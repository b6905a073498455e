"""Kinova's Gen3 with seven joints, by the numbers in its maker's user guide (EN-UG-014): kinematics without shapes.

The frames are those of the guide's homogeneous transform matrices for the 7 DoF robot with the spherical
wrist; the joint ranges and speeds are those of its tables of actuator limits.
"""

from math import pi, radians
from pathlib import Path

from er_il.arms.chain import ChainJoint, Tool, chain_urdf
from er_il.arms.urdf import generated_urdf

LARGE, SMALL = radians(79.64), radians(69.91)  # [rad/s] speed of the two sizes of actuator
BENDS = {2: 128.9, 4: 147.8, 6: 120.3}  # [deg] to either side; the other joints turn without end

# Position [m] of each joint in the frame before, and its turn [rad] about that frame's x.
FRAMES = (
    ((0.0, 0.0, 0.1564), pi),
    ((0.0, 0.0054, -0.1284), pi / 2),
    ((0.0, -0.2104, -0.0064), -pi / 2),
    ((0.0, 0.0064, -0.2104), pi / 2),
    ((0.0, -0.2084, -0.0064), -pi / 2),
    ((0.0, 0.0, -0.1059), pi / 2),
    ((0.0, -0.1059, 0.0), -pi / 2),
)
LINKS = (
    "shoulder_link",
    "half_arm_1_link",
    "half_arm_2_link",
    "forearm_link",
    "spherical_wrist_1_link",
    "spherical_wrist_2_link",
    "bracelet_link",
)


def gen3_urdf() -> Path:
    """Path of the generated URDF, written on first use to the folder for temporary files."""
    joints = [
        ChainJoint(
            name=f"joint_{i}",
            link=link,
            xyz=xyz,
            rpy=(turn, 0.0, 0.0),
            range=(-radians(BENDS[i]), radians(BENDS[i])) if i in BENDS else None,
            velocity=LARGE if i <= 4 else SMALL,
        )
        for i, (link, (xyz, turn)) in enumerate(zip(LINKS, FRAMES, strict=True), start=1)
    ]
    tool = Tool("end_effector_link", (0.0, 0.0, -0.0615), (pi, 0.0, 0.0))
    return generated_urdf(chain_urdf("gen3", "base_link", joints, tool), "gen3.urdf")
