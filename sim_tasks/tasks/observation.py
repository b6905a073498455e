"""Observations of an arm and of the objects around it."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

from er_il.arms.arm import Arm
from er_il.kinematics.rotation import Quaternion, make_rotation
from er_il.kinematics.solver import kinematics_of
from er_il.support.shapes import POSE_NAMES
from sim_tasks.world.camera import Cameras
from sim_tasks.world.robot import RobotModel

XYZW = [1, 2, 3, 0]  # order of a quaternion's entries, whose real part MuJoCo has first


class Observer:
    """Measures ``agent_pos``, ``environment_state`` and, with cameras, ``pixels``."""

    def __init__(
        self, arm: Arm, model: mujoco.MjModel, robot: RobotModel, objects: Sequence[str], cameras: Cameras
    ) -> None:
        """Observe ``robot``, the ``arm`` compiled into ``model``, and the poses of the bodies ``objects``."""
        self._kinematics = kinematics_of(arm)
        self._robot, self._cameras = robot, cameras
        self._objects = np.array([model.body(name).id for name in objects])
        self._rotation = make_rotation(Quaternion.kind, self._kinematics.fk(arm.home)[:3, :3])
        self._quaternion = np.zeros(4)
        pose = ("ee.x", "ee.y", "ee.z", *Quaternion.names)
        self.state_names = (*(f"{joint}.pos" for joint in arm.joints), "gripper", *pose)
        self.environment_state_names = tuple(f"{name}.{part}" for name in objects for part in POSE_NAMES)

    def space(self) -> gym.spaces.Dict:
        """Gymnasium space of the observations."""

        def unbounded(size: int) -> gym.spaces.Box:
            return gym.spaces.Box(-np.inf, np.inf, (size,), np.float32)

        spaces: dict[str, gym.Space[Any]] = {
            "agent_pos": unbounded(len(self.state_names)),
            "environment_state": unbounded(len(self.environment_state_names)),
        }
        if self._cameras.names:
            image = gym.spaces.Box(0, 255, (self._cameras.size, self._cameras.size, 3), np.uint8)
            spaces["pixels"] = gym.spaces.Dict(dict.fromkeys(self._cameras.names, image))
        return gym.spaces.Dict(spaces)

    def reset(self, data: mujoco.MjData) -> dict[str, Any]:
        """Observe the first state of an episode; its quaternion has the sign of the arm's home posture."""
        T_base_ee = self._kinematics.fk(self._robot.joint_positions(data))
        self._quaternion = self._rotation.encode(T_base_ee[None, :3, :3])[0]
        return self.observe(data)

    def observe(self, data: mujoco.MjData) -> dict[str, Any]:
        """Observe a state; successive quaternions keep their sign, so that they do not jump."""
        q = self._robot.joint_positions(data)
        T_base_ee = self._kinematics.fk(q)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, T_base_ee[:3, :3].ravel())
        quaternion = quaternion[XYZW]
        self._quaternion = quaternion if quaternion @ self._quaternion >= 0 else -quaternion
        agent = [q, [self._robot.opening(data)], T_base_ee[:3, 3], self._quaternion]
        poses = np.concatenate([data.xpos[self._objects], data.xquat[self._objects][:, XYZW]], axis=1)
        observation: dict[str, Any] = {
            "agent_pos": np.concatenate(agent).astype(np.float32),
            "environment_state": poses.ravel().astype(np.float32),
        }
        if self._cameras.names:
            observation["pixels"] = self._cameras.images(data)
        return observation


def object_pose(data: mujoco.MjData, name: str) -> np.ndarray:
    """Position [m] and quaternion (x, y, z, w) of a body in the base frame, (7,)."""
    body = data.body(name)
    return np.concatenate([body.xpos, body.xquat[XYZW]])
