"""Collision checks of a robot's postures."""

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from sim_tasks.world.robot import RobotModel


class Collisions:
    """Checks joint angles against a world, with a margin all around the robot."""

    def __init__(
        self,
        spec: mujoco.MjSpec,
        roots: Sequence[str],
        find: Callable[[mujoco.MjModel], Sequence[RobotModel]],
        obstacles: tuple[str, ...],
        clearance: float,
    ) -> None:
        """Compile a copy of the world in which the robot is ``clearance`` [m] thicker.

        Args:
            spec: The world.
            roots: Lowest body of each arm.
            find: Looks the arms up in the compiled copy.
            obstacles: Bodies that it must not touch.
            clearance: Margin [m] around the robot.
        """
        thick = spec.copy()
        for root in roots:
            for geom in thick.body(root).find_all(mujoco.mjtObj.mjOBJ_GEOM):
                geom.margin = clearance
        self._model = thick.compile()
        self._data = mujoco.MjData(self._model)
        self._arms = find(self._model)
        self._obstacles = np.array([self._model.body(name).id for name in obstacles])
        self._robot_bodies = np.array(sorted(frozenset().union(*(arm.bodies for arm in self._arms))))

    @classmethod
    def of_arm(cls, spec: mujoco.MjSpec, arm: Arm, obstacles: tuple[str, ...], clearance: float) -> "Collisions":
        """The checks of a single arm."""
        return cls(spec, [arm.base_frame], lambda model: [RobotModel.of(model, arm)], obstacles, clearance)

    def copy(self, data: mujoco.MjData) -> None:
        """Put everything where it is in a state of the same world."""
        self._data.qpos[:] = data.qpos
        self._data.mocap_pos[:], self._data.mocap_quat[:] = data.mocap_pos, data.mocap_quat

    def is_free(self, q: Vector) -> bool:
        """True if the arms at q (n,) [rad], grippers open, touch neither the obstacles nor themselves."""
        for arm, angles in zip(self._arms, np.split(q, len(self._arms)), strict=True):
            arm.place(self._data, angles, 1.0)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        bodies = self._model.geom_bodyid[self._data.contact.geom].reshape(-1, 2)
        robot = np.isin(bodies, self._robot_bodies)
        obstacle = np.isin(bodies, self._obstacles)
        return not np.any(np.all(robot | obstacle, axis=1) & np.any(robot, axis=1))
