"""Distances between an arm and the world around it, were the arm elsewhere."""

from collections.abc import Collection

import mujoco
import numpy as np

from sim_tasks.world.contact import collision_geoms, distance
from sim_tasks.world.robot import RobotModel, descends


class Clearance:
    """Measures the links whose place the hand's pose leaves open: from the first joint to before the last."""

    def __init__(self, model: mujoco.MjModel, robot: RobotModel, touched: Collection[int]) -> None:
        """Measure to every body that collides but the robot's own and ``touched``."""
        self._model, self._robot = model, robot
        self._probe = mujoco.MjData(model)
        first, last = model.dof_bodyid[robot.joint_dofs[[0, -1]]].tolist()
        links = [body for body in robot.bodies if descends(model, body, first) and not descends(model, body, last)]
        shapes = (collision_geoms(model, {link}) for link in sorted(links))
        self._links = [shape for shape in shapes if shape]
        self._obstacles = collision_geoms(model, set(range(model.nbody)) - robot.bodies - set(touched))

    def distances(self, data: mujoco.MjData, q: np.ndarray, most: float) -> np.ndarray:
        """Distance (L,) [m] of each link to what is nearest it, with the arm at q (n,) [rad], at most ``most``."""
        model, probe = self._model, self._probe
        probe.qpos[:], probe.mocap_pos[:], probe.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
        probe.qpos[self._robot.joint_qpos] = q
        mujoco.mj_kinematics(model, probe)
        return np.array([distance(model, probe, link, self._obstacles, most) for link in self._links])
