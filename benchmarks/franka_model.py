"""The MJCF of a Franka Research 3 for its simulated server: python benchmarks/franka_model.py fr3.xml"""

import sys
from pathlib import Path

import mujoco

from er_il.arms.arm import Arm

DAMPING, ARMATURE = 1.0, 0.1  # [Nms/rad], [kgm²] of every joint, as MuJoCo Menagerie's models of these arms have


def write_fr3_mjcf(path: Path) -> None:
    """Write a model of the arm without fingers, whose links' shapes the server can tell."""
    spec = mujoco.MjSpec.from_file(str(Arm.preset("fr3").urdf))
    spec.compiler.discardvisual = True
    spec.compiler.fusestatic = False
    for side in ("left", "right"):
        spec.delete(spec.body(f"fr3_{side}finger"))
    for body in spec.bodies:
        for geom in body.geoms:
            geom.name = f"{body.name}_collision"
    for joint in spec.joints:
        joint.damping[0], joint.armature = DAMPING, ARMATURE
    spec.compile()
    path.write_text(spec.to_xml())


if __name__ == "__main__":
    write_fr3_mjcf(Path(sys.argv[1]))
