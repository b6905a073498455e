"""Write ``reference.npz``: hand poses of OpenArm by its maker's MuJoCo models, which test_openarm.py compares with.

    python tests/openarm/reference.py v1/openarm_bimanual.xml v2/openarm_bimanual.xml

The models are those of https://github.com/enactic/openarm_mujoco (Apache-2.0): version 1 at commit 96c88d8, version 2
of the package openarm-mujoco 2.3.0. Version 1's hand frame is its own; of version 2 it is the control point of
openarm-control 0.5.0, which lies in the wrist.
"""

from pathlib import Path

import mujoco
import numpy as np
import tyro
from tyro.conf import Positional

SIDES = ("left", "right")
CONFIGURATIONS = 1000
HANDS = {"v1": "openarm_{}_hand_tcp", "v2": "openarm_{}_ee_base_link"}  # bodies


def main(v1: Positional[Path], v2: Positional[Path]) -> None:
    """Draw configurations within the models' limits, and write the poses of the hands there."""
    arrays: dict[str, np.ndarray] = {}
    for version, path in (("v1", v1), ("v2", v2)):
        model = _without_shapes(path)
        data = mujoco.MjData(model)
        for side in SIDES:
            joints = [model.joint(f"openarm_{side}_joint{i}") for i in range(1, 8)]
            limits = np.array([joint.range for joint in joints])
            q = np.random.default_rng(0).uniform(*limits.T, (CONFIGURATIONS, 7)).astype(np.float32)
            hand = model.body(HANDS[version].format(side)).id
            poses = []
            for angles in q:
                data.qpos[[joint.qposadr[0] for joint in joints]] = angles
                mujoco.mj_kinematics(model, data)
                poses.append(np.append(data.xpos[hand], data.xquat[hand]))
            name = f"openarm_{version}_{side}"
            arrays |= {f"{name}.limits": limits, f"{name}.q": q, f"{name}.pose": np.array(poses, dtype=np.float32)}
    np.savez_compressed(Path(__file__).with_name("reference.npz"), **arrays)


def _without_shapes(path: Path) -> mujoco.MjModel:
    """Compile a model's bodies and joints; its meshes need not be there."""
    spec = mujoco.MjSpec.from_file(str(path))
    for part in (*spec.geoms, *spec.meshes):
        spec.delete(part)
    return spec.compile()


if __name__ == "__main__":
    tyro.cli(main)
