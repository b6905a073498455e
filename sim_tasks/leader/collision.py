"""Collision checks of the arm's postures."""

import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from sim_tasks.world.robot import RobotModel


class Collisions:
    """Checks joint angles against a world, with a margin all around the robot."""

    def __init__(self, spec: mujoco.MjSpec, arm: Arm, obstacles: tuple[str, ...], clearance: float) -> None:
        """Compile a copy of the world in which the robot is ``clearance`` [m] thicker."""
        thick = spec.copy()
        for geom in thick.body(arm.base_frame).find_all(mujoco.mjtObj.mjOBJ_GEOM):
            geom.margin = clearance
        self._model = thick.compile()
        self._data = mujoco.MjData(self._model)
        self._robot = RobotModel.of(self._model, arm)
        self._obstacles = np.array([self._model.body(name).id for name in obstacles])
        self._robot_bodies = np.array(sorted(self._robot.bodies))

    def copy(self, data: mujoco.MjData) -> None:
        """Put everything where it is in a state of the same world."""
        self._data.qpos[:] = data.qpos
        self._data.mocap_pos[:], self._data.mocap_quat[:] = data.mocap_pos, data.mocap_quat

    def is_free(self, q: Vector) -> bool:
        """True if the arm at q (n,) [rad], gripper open, touches neither the obstacles nor itself."""
        self._robot.place(self._data, q, 1.0)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        bodies = self._model.geom_bodyid[self._data.contact.geom].reshape(-1, 2)
        robot = np.isin(bodies, self._robot_bodies)
        obstacle = np.isin(bodies, self._obstacles)
        return not np.any(np.all(robot | obstacle, axis=1) & np.any(robot, axis=1))
