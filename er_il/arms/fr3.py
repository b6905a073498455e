"""The Franka Research 3: the kinematics and shapes of the Panda's URDF, with its own names and joint limits.

Both arms have the same link lengths. Limits are those of ``robots/fr3/joint_limits.yaml`` in Franka's
franka_description (version 0.1; later versions are wider by less than 0.01 rad).
"""

import xml.etree.ElementTree as ET
from pathlib import Path

from er_il.arms.urdf import example_robot_data, generated_urdf, name_meshes_in, parse_urdf

FROM, TO = "panda_", "fr3_"  # prefix of links and joints

# Joint -> lower and upper limit [rad], velocity limit [rad/s].
LIMITS = {
    "fr3_joint1": (-2.7437, 2.7437, 2.62),
    "fr3_joint2": (-1.7837, 1.7837, 2.62),
    "fr3_joint3": (-2.9007, 2.9007, 2.62),
    "fr3_joint4": (-3.0421, -0.1518, 2.62),
    "fr3_joint5": (-2.8065, 2.8065, 5.26),
    "fr3_joint6": (0.5445, 4.5169, 4.18),
    "fr3_joint7": (-3.0159, 3.0159, 5.26),
}


def fr3_urdf() -> Path:
    """Path of the generated URDF, written on first use to the folder for temporary files."""
    panda = example_robot_data("panda_description/urdf/panda.urdf")
    return generated_urdf(_fr3_xml(parse_urdf(panda), panda.parents[4]), "fr3.urdf")


def _fr3_xml(panda: ET.Element, packages: Path) -> str:
    panda.set("name", "fr3")
    for element in panda.iter():
        for role in ("name", "link", "joint"):  # joints name the links they connect, mimics the joint they follow
            if (name := element.get(role)) is not None:
                element.set(role, name.replace(FROM, TO))
    for joint in panda.iter("joint"):
        if (limits := LIMITS.get(joint.get("name", ""))) is not None:
            limit, soft = joint.find("limit"), joint.find("safety_controller")
            assert limit is not None and soft is not None  # the Panda's revolute joints have both
            joint.remove(soft)
            limit.attrib.update(zip(("lower", "upper", "velocity"), map(str, limits), strict=True))
    name_meshes_in(panda, packages)
    return ET.tostring(panda, encoding="unicode")
