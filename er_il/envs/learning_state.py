"""The state that reinforcement learning observes, as one flat vector."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Vector
from er_il.envs.protocol import DirectedEnv, LearnableEnv
from er_il.kinematics.forward import forward_of
from er_il.kinematics.rotation import quaternion_rows
from er_il.support.shapes import POSE_NAMES

TURN_NAMES = ("xx", "xy", "xz", "yx", "yy", "yz")  # x and y axis of a frame: unlike quaternions unique
WAY_NAMES = ("dx", "dy", "dz")


class LearningState:
    """Measures the robot's state and what its task is about.

    float32, in this order: joint angles [rad], joint velocities [rad/s], the gripper's opening, the end effector's
    position [m] and axes, the elbow's position [m] (of arms that have one), the last command minus the joint angles
    [rad], 1 if a thing is grasped; then the world's ways and directions (:class:`er_il.envs.protocol.DirectedEnv`). A
    world that has none: for each object its position from the end effector [m] and its axes.
    """

    def __init__(self, world: LearnableEnv, objects: bool) -> None:
        """Observe ``world``, with its ``objects`` or the robot alone."""
        self._world = world
        self._directed = world if objects and isinstance(world, DirectedEnv) else None
        self._objects = objects and not self._directed
        frames = world.arm.angle_frames
        self._forward, self._elbow = forward_of(world.arm), frames.elbow if frames else None
        joints = world.arm.joints
        names = [f"{joint}.pos" for joint in joints] + [f"{joint}.vel" for joint in joints]
        names += ["gripper", "ee.x", "ee.y", "ee.z", *(f"ee.{part}" for part in TURN_NAMES)]
        names += ["elbow.x", "elbow.y", "elbow.z"] if self._elbow else []
        names += [f"{joint}.left" for joint in joints] + ["grasped"]
        if self._directed:
            names += [f"{way}.{part}" for way in self._directed.ways for part in WAY_NAMES]
            names += [f"{direction}.{part}" for direction in self._directed.directions for part in "xyz"]
        elif objects:
            poses = world.environment_state_names[:: len(POSE_NAMES)]
            for thing in (name.rpartition(".")[0] for name in poses):
                names += [f"{thing}.{part}" for part in (*WAY_NAMES, *TURN_NAMES)]
        self.names = tuple(names)
        self.space = gymnasium.spaces.Box(-np.inf, np.inf, (len(names),), np.float32)

    def observe(self, observation: dict[str, Any], command: Vector) -> NDArray[np.float32]:
        """The state (len(names),), from the environment's observation and the last command (n,) [rad]."""
        world, n = self._world, self._world.arm.dof
        agent = observation["agent_pos"].astype(np.float64)
        q, ee = world.joint_positions, agent[n + 1 : n + 4]
        hand = axes(agent[None, n + 4 :])[0]
        parts = [q, world.joint_velocities, agent[n : n + 1], ee, hand]
        if self._elbow:
            parts.append(self._forward.frame_pose(q, self._elbow)[:3, 3])
        parts += [command - q, (float(world.grasped),)]
        if self._directed:
            parts += [*self._directed.ways.values(), *self._directed.directions.values()]
        elif self._objects:
            poses = observation["environment_state"].astype(np.float64).reshape(-1, len(POSE_NAMES))
            parts.append(np.hstack([poses[:, :3] - ee, axes(poses[:, 3:])]).ravel())
        return np.concatenate(parts).astype(np.float32)


def axes(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The x and y axes (N, 6) of frames whose orientations are unit quaternions (N, 4) (x, y, z, w)."""
    rows = (quaternion_rows(*quaternion) for quaternion in quaternions.tolist())
    return np.array([(a[0], b[0], c[0], a[1], b[1], c[1]) for a, b, c in rows])
