"""A compiled world as shapes that a viewer can draw."""

from collections.abc import Collection
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from er_il.support.shapes import Shape

KINDS: dict[int, tuple[Any, int]] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): ("box", 3),
    int(mujoco.mjtGeom.mjGEOM_SPHERE): ("sphere", 1),
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): ("ellipsoid", 3),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): ("cylinder", 2),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): ("capsule", 2),
    int(mujoco.mjtGeom.mjGEOM_MESH): ("mesh", 0),
}  # MuJoCo's type: kind, and how many of its sizes count
HIDDEN_GROUPS = (3, 4, 5)  # collision shapes, as in MuJoCo's own viewer


def world_shapes(
    model: mujoco.MjModel, data: mujoco.MjData, leave_out: Collection[int], objects: Collection[str]
) -> list[Shape]:
    """Describe all visible shapes except those of some bodies.

    Args:
        model: The world.
        data: Its state; fixed shapes are where they are now.
        leave_out: Ids of bodies to leave out (the robot's).
        objects: Names of moving bodies; their shapes are given in the body's own frame.
    """
    shapes = []
    for i in range(model.ngeom):
        body = int(model.geom_bodyid[i])
        kind = KINDS.get(int(model.geom_type[i]))
        if kind is None or body in leave_out or model.geom_group[i] in HIDDEN_GROUPS:
            continue
        parent = model.body(body).name if model.body(body).name in objects else ""
        T = np.eye(4)
        if parent:
            T[:3, :3] = Rotation.from_quat(model.geom_quat[i], scalar_first=True).as_matrix()
            T[:3, 3] = model.geom_pos[i]
        else:
            T[:3, :3], T[:3, 3] = data.geom_xmat[i].reshape(3, 3), data.geom_xpos[i]
        material = int(model.geom_matid[i])
        rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[i]
        vertices, faces = _mesh(model, int(model.geom_dataid[i])) if kind[0] == "mesh" else (None, None)
        size = tuple(float(x) for x in model.geom_size[i][: kind[1]])
        name = model.geom(i).name or f"{model.body(body).name}_{i}"
        shapes.append(Shape(name, kind[0], size, tuple(rgba.tolist()), T, parent, vertices, faces))
    return shapes


def _mesh(model: mujoco.MjModel, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    first_face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return (
        model.mesh_vert[first : first + count].astype(np.float64),
        model.mesh_face[first_face : first_face + faces].astype(np.int64),
    )
