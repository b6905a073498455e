"""Datasets with the columns and names of public ones, written with plain LeRobot calls."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from foreign import paths
from lerobot.datasets import LeRobotDataset

from er_il import Arm
from er_il.kinematics.solver import kinematics_of

PANDA = Arm.preset("panda")
LENGTHS = (12, 9)
DROID_JOINTS = [f"joint_{i}" for i in range(7)]
G1 = [
    f"k{side}{joint}"
    for side in ("Left", "Right")
    for joint in ("ShoulderPitch", "ShoulderRoll", "ShoulderYaw", "Elbow", "WristRoll", "WristPitch", "WristYaw")
]
G1_HANDS = ["kLeftGripper", "kRightGripper"]

Columns = Mapping[str, np.ndarray]


def write_columns(root: Path, names: Mapping[str, Any], episodes: Sequence[Columns], fps: int = 20) -> Path:
    """Write columns (T, k), by episode, each with the names that its feature has."""
    features = {
        column: {"dtype": "float32", "shape": (values.shape[1],), "names": names[column]}
        for column, values in episodes[0].items()
    }
    dataset = LeRobotDataset.create("lab/public", fps, features, root=root, use_videos=False)
    for columns in episodes:
        for t in range(len(next(iter(columns.values())))):
            dataset.add_frame({name: rows[t].astype(np.float32) for name, rows in columns.items()} | {"task": "move"})
        dataset.save_episode()
    dataset.finalize()
    return root


def joint_paths(seed: int = 0, arm: Arm = PANDA) -> list[np.ndarray]:
    """Commanded joints (T, 7) [rad] by episode."""
    return paths(arm, seed, LENGTHS)


def lagged(commanded: np.ndarray) -> np.ndarray:
    """What was measured: each frame's joints are the command of the frame before."""
    return np.concatenate([commanded[:1], commanded[:-1]])


def opening(length: int) -> np.ndarray:
    return np.linspace(0, 1, length)[:, None]


def droid(root: Path, dropped: Sequence[str] = ()) -> Path:
    """LeRobot's port of DROID: joints and gripper in ``action``, with parts and other actions beside it."""
    axes = {"joint_position": DROID_JOINTS, "gripper_position": ["gripper"], "joint_velocity": DROID_JOINTS}
    names = {f"action.{part}": {"axes": own} for part, own in axes.items()}
    names |= {"action": {"axes": [*DROID_JOINTS, "gripper"]}, "observation.state": {"axes": [*DROID_JOINTS, "gripper"]}}
    episodes = []
    for q in joint_paths():
        grip, measured = opening(len(q)), lagged(q)
        columns = {"action.joint_position": q, "action.gripper_position": grip, "action.joint_velocity": q - measured}
        columns |= {"action": np.hstack([q, grip]), "observation.state": np.hstack([measured, lagged(grip)])}
        episodes.append({name: rows for name, rows in columns.items() if name not in dropped})
    return write_columns(root, names, episodes)


def uma(root: Path) -> Path:
    """Poses of the end effector in ``action``, the joints in a column beside it."""
    pose = ["x", "y", "z", *(f"r{i}" for i in range(6)), "gripper"]
    names = {"action": pose, "action.joint_position": DROID_JOINTS, "observation.state": [*DROID_JOINTS, "gripper"]}
    episodes = []
    for q in joint_paths():
        T_base_ee, grip = kinematics_of(PANDA).fk_batch(q), opening(len(q))
        rotation = np.array([np.asarray(T[:3, :2]).ravel() for T in T_base_ee])
        columns = {"action": np.hstack([T_base_ee[:, :3, 3], rotation, grip]), "action.joint_position": q}
        episodes.append(columns | {"observation.state": np.hstack([lagged(q), lagged(grip)])})
    return write_columns(root, names, episodes)


def libero(root: Path, arm: Arm = PANDA) -> Path:
    """Changes of the end effector and a gripper in ``action``, the joints in a column of their own (any4lerobot)."""
    pose = ["x", "y", "z", "roll", "pitch", "yaw"]
    names = {"action": {"motors": [*pose, "gripper"]}, "observation.state": {"motors": [*pose, "gripper", "gripper"]}}
    names |= {"observation.states.joint_state": {"motors": DROID_JOINTS}}
    episodes = []
    for q in joint_paths(arm=arm):
        rng = np.random.default_rng(len(q))
        T_base_ee, grip = kinematics_of(arm).fk_batch(q), np.where(opening(len(q)) > 0.5, 1.0, -1.0)
        state = np.hstack([T_base_ee[:, :3, 3], rng.uniform(2.9, 3.2, (len(q), 3)), grip * 0.02, -grip * 0.02])
        columns = {"action": np.hstack([rng.uniform(-0.6, 0.6, (len(q), 6)), grip]), "observation.state": state}
        episodes.append(columns | {"observation.states.joint_state": q})
    return write_columns(root, names, episodes)


def unitree(root: Path) -> Path:
    """Unitree's G1: the names of all motors in a list in a list."""
    names = {"action": [[*G1, *G1_HANDS]], "observation.state": [[*G1, *G1_HANDS]]}
    episodes = []
    for left, right in zip(joint_paths(0), joint_paths(1), strict=True):
        motors = np.hstack([left, right, opening(len(left)), opening(len(left))])
        episodes.append({"action": motors, "observation.state": lagged(motors)})
    return write_columns(root, names, episodes)


def agibot(root: Path) -> Path:
    """AgiBot World: no ``action``, both arms in one column without names, the grippers in another (any4lerobot)."""
    columns = ("actions.joint.position", "actions.effector.position")
    columns += ("observation.states.joint.position", "observation.states.effector.position")
    episodes = []
    for left, right in zip(joint_paths(0), joint_paths(1), strict=True):
        arms, grippers = np.hstack([left, right]), np.hstack([opening(len(left))] * 2)
        episodes.append(dict(zip(columns, (arms, grippers, lagged(arms), lagged(grippers)), strict=True)))
    return write_columns(root, dict.fromkeys(columns), episodes)
