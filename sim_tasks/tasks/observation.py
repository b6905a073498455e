"""Observations of a robot's arms and of the objects around it."""

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

import gymnasium as gym
import mujoco
import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.rotation import Quaternion, make_rotation
from er_il.kinematics.solver import kinematics_of
from er_il.support.shapes import POSE_NAMES
from sim_tasks.world.camera import Cameras
from sim_tasks.world.robot import RobotModel

XYZW = [1, 2, 3, 0]  # order of a quaternion's entries, whose real part MuJoCo has first


class ArmObserver:
    """Measures one arm: its joints, its gripper's opening, and the pose of its end effector."""

    def __init__(self, label: str, arm: Arm, robot: RobotModel) -> None:
        """Observe ``robot``, the ``arm`` compiled into a model; its names begin with the label, if any."""
        self._kinematics, self._robot = kinematics_of(arm), robot
        self._rotation = make_rotation(Quaternion.kind, self._kinematics.fk(arm.home)[:3, :3])
        self._quaternion: Vector = np.zeros(4)
        prefix = f"{label}_" if label else ""
        self.joint_names = tuple(f"{joint}.pos" for joint in arm.joints)
        self.gripper_name = f"{prefix}gripper"
        self.pose_names = tuple(prefix + name for name in ("ee.x", "ee.y", "ee.z", *Quaternion.names))

    def reset(self, data: mujoco.MjData) -> None:
        """Start an episode; its first quaternion has the sign of the arm's home posture."""
        T_base_ee = self._kinematics.fk(self._robot.joint_positions(data))
        self._quaternion = self._rotation.encode(T_base_ee[None, :3, :3])[0]

    def observe(self, data: mujoco.MjData) -> tuple[Vector, float, Vector]:
        """Joint positions (n,) [rad], opening, and pose (7,); successive quaternions do not jump."""
        q = self._robot.joint_positions(data)
        T_base_ee = self._kinematics.fk(q)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, T_base_ee[:3, :3].ravel())
        quaternion = quaternion[XYZW]
        self._quaternion = quaternion if quaternion @ self._quaternion >= 0 else -quaternion
        return q, self._robot.opening(data), np.concatenate([T_base_ee[:3, 3], self._quaternion])


class Observer:
    """Measures ``agent_pos``, ``environment_state`` and, with cameras, ``pixels``.

    ``agent_pos`` holds all arms' joints, then all openings, then all poses of end effectors.
    """

    def __init__(
        self,
        arms: Mapping[str, Arm],
        model: mujoco.MjModel,
        robots: Sequence[RobotModel],
        objects: Sequence[str],
        cameras: Cameras,
    ) -> None:
        """Observe ``robots``, the ``arms`` by their labels compiled into ``model``, and the bodies ``objects``."""
        self._arms = [ArmObserver(*each, robot) for each, robot in zip(arms.items(), robots, strict=True)]
        self._cameras = cameras
        self._objects = np.array([model.body(name).id for name in objects])
        joints, poses = (chain(*(getattr(arm, names) for arm in self._arms)) for names in ("joint_names", "pose_names"))
        self.state_names = (*joints, *(arm.gripper_name for arm in self._arms), *poses)
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
        """Observe the first state of an episode."""
        for arm in self._arms:
            arm.reset(data)
        return self.observe(data)

    def observe(self, data: mujoco.MjData) -> dict[str, Any]:
        """Observe a state."""
        joints, openings, hands = zip(*(arm.observe(data) for arm in self._arms), strict=True)
        poses = np.concatenate([data.xpos[self._objects], data.xquat[self._objects][:, XYZW]], axis=1)
        observation: dict[str, Any] = {
            "agent_pos": np.concatenate([*joints, openings, *hands]).astype(np.float32),
            "environment_state": poses.ravel().astype(np.float32),
        }
        if self._cameras.names:
            observation["pixels"] = self._cameras.images(data)
        return observation


def object_pose(data: mujoco.MjData, name: str) -> np.ndarray:
    """Position [m] and quaternion (x, y, z, w) of a body in the base frame, (7,)."""
    body = data.body(name)
    return np.concatenate([body.xpos, body.xquat[XYZW]])
