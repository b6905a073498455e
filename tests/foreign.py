"""Datasets that er_il did not make, written with plain LeRobot calls."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from lerobot.datasets import LeRobotDataset

from er_il import Arm
from er_il.arms.robot import robot_arms

LENGTHS = (40, 30, 20)
LEFT, RIGHT = Arm.preset("panda"), Arm.preset("xarm7")
LEFT_JOINTS = tuple(f"left_joint_{i}.pos" for i in range(1, 8))
RIGHT_JOINTS = tuple(f"right_joint_{i}.pos" for i in range(1, 8))
SIGNS, OFFSETS = (1, -1, 1, 1, -1, 1, 1), (0, 0, 0, 90, 0, -90, 0)  # of the right arm: q = sign * motor + offset
MOTORS = tuple(f"motor_{i}" for i in range(1, 8))
GRIPPERS = ("left_gripper.pos", "right_gripper.pos")
NAMES = tuple(np.random.default_rng(3).permutation([*LEFT_JOINTS, *RIGHT_JOINTS, *GRIPPERS, "lift.height"]).tolist())

ARMS = f"""
left:
  arm: panda
  joints: [{", ".join(LEFT_JOINTS)}]
  units: deg
right:
  arm: xarm7
  joints: [{", ".join(RIGHT_JOINTS)}]
  units: deg
  signs: {list(SIGNS)}
  offsets: {list(OFFSETS)}
"""


def paths(arm: Arm, seed: int, lengths=LENGTHS, reach=0.4) -> list[np.ndarray]:
    """Smooth joint paths (T, n) [rad] around an arm's home posture, an array an episode."""
    rng = np.random.default_rng(seed)
    found = []
    for length in lengths:
        t = np.arange(length)[:, None] / 20
        wave = rng.uniform(0, reach, arm.dof) * np.sin(rng.uniform(0.5, 2, arm.dof) * t + rng.uniform(0, 6, arm.dof))
        found.append(np.clip(arm.home + wave, arm.lower + 0.01, arm.upper - 0.01))
    return found


def bimanual(lengths=LENGTHS) -> list[dict[str, np.ndarray]]:
    """Values of each named dimension (T,), by episode: joints in degrees, grippers 0 to 100, a lift in metres."""
    episodes = []
    for left, right in zip(paths(LEFT, 0, lengths), paths(RIGHT, 1, lengths), strict=True):
        motors = (np.rad2deg(right) - OFFSETS) * SIGNS
        values = dict(zip(LEFT_JOINTS, np.rad2deg(left).T, strict=True)) | dict(
            zip(RIGHT_JOINTS, motors.T, strict=True)
        )
        ramp = np.linspace(0, 100, len(left))
        episodes.append(values | {GRIPPERS[0]: ramp, GRIPPERS[1]: 100 - ramp, "lift.height": ramp / 1000})
    return episodes


def write_bimanual(root: Path, camera: bool = False) -> Path:
    """Write :func:`bimanual` as a dataset: the action is the joints, the state the joints a step before."""
    return write_dataset(root, bimanual(), NAMES, camera)


def write_dataset(root: Path, episodes: list[dict[str, np.ndarray]], names: Sequence[str], camera: bool) -> Path:
    """Write named values (T,), by episode: the action is all of them, the state all of them a step before."""
    vector = {"dtype": "float32", "shape": (len(names),), "names": list(names)}
    features = {"action": vector, "observation.state": dict(vector), "note": {"dtype": "int64", "shape": (1,)}}
    features["note"]["names"] = None
    features["observation.environment_state"] = {"dtype": "float32", "shape": (2,), "names": ["x", "y"]}
    if camera:
        image = {"dtype": "video", "shape": (32, 32, 3), "names": ["height", "width", "channels"]}
        features["observation.images.top"] = image
    dataset = LeRobotDataset.create("lab/bimanual", 20, features, root=root, robot_type="bi_lab", video_backend="pyav")
    for values in episodes:
        rows = np.stack([values[name] for name in names], axis=1).astype(np.float32)
        for t, row in enumerate(rows):
            frame = {"action": row, "observation.state": rows[max(0, t - 1)], "note": np.array([t]), "task": "fold"}
            frame["observation.environment_state"] = np.array([t, -t], dtype=np.float32)
            if camera:
                frame["observation.images.top"] = np.full((32, 32, 3), t, dtype=np.uint8)
            dataset.add_frame(frame)
        dataset.save_episode()
    dataset.finalize()
    return root


def write_one_arm(root: Path, arm: Arm, names: Sequence[str], degrees: bool = False) -> Path:
    """Write :func:`paths` of one arm under the names that its joints have there."""
    episodes = [
        dict(zip(names, (np.rad2deg(path) if degrees else path).T, strict=True)) | {"gripper.pos": path[:, 0]}
        for path in paths(arm, 0)
    ]
    return write_dataset(root, episodes, [*names, "gripper.pos"], camera=False)


def write_openarm(folder: Path) -> None:
    """Write demonstrations with two OpenArms as LeRobot's driver names them, in ``demos/openarm``."""
    values: dict[str, list[np.ndarray]] = {}
    for seed, (side, arm) in enumerate(robot_arms("openarm_v2").items()):
        for path in paths(arm, seed):
            for i, joint in enumerate(np.rad2deg(path).T, start=1):
                values.setdefault(f"{side}_joint_{i}.pos", []).append(joint)
            values.setdefault(f"{side}_gripper.pos", []).append(np.linspace(-60, 0, len(path)))
    episodes = [{name: rows[episode] for name, rows in values.items()} for episode in range(len(LENGTHS))]
    write_dataset(folder / "demos" / "openarm", episodes, list(values), camera=True)


def write_swing(root: Path, motors: Sequence[str] = MOTORS) -> Path:
    """A dataset that does not know its arm: a Panda's motors in degrees, its elbow swinging about the vertical."""
    names = [*motors, "gripper"]
    feature = {"dtype": "float32", "shape": (8,), "names": names}
    dataset = LeRobotDataset.create("lab/arm", 20, {"action": feature}, root=root, robot_type="arm", use_videos=False)
    for _ in range(2):
        for share in np.linspace(0, 2 * np.pi, 25):
            q = LEFT.home + 0.3 * np.sin(share) * np.array([1, 0, -1, 0, 0, 0, 0])
            frame = np.append(np.rad2deg(q), 1.0).astype(np.float32)
            dataset.add_frame({"action": frame, "task": "swing"})
        dataset.save_episode()
    dataset.finalize()
    return root
