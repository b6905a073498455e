"""Datasets with the columns, names and rates of public ones, written with plain LeRobot calls.

Where each schema was read is on the page ``docs/public_datasets.md``. Pictures are smaller here, of one camera each.
"""

import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
from foreign import paths
from lerobot.datasets import LeRobotDataset
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.arms.urdf import example_robot_data
from er_il.datasets.dataset import Dataset
from er_il.kinematics.solver import kinematics_of

PANDA = Arm.preset("panda")
LENGTHS = (12, 9)
SIZE = 32  # [px] of pictures
SIDES = ("left", "right")
DROID_JOINTS = [f"joint_{i}" for i in range(7)]
DROID = [*DROID_JOINTS, "gripper"]
EULER = ["x", "y", "z", "roll", "pitch", "yaw"]
AXIS_ANGLE = ["x", "y", "z", "axis_angle1", "axis_angle2", "axis_angle3"]
G1 = [
    f"k{side}{joint}"
    for side in ("Left", "Right")
    for joint in ("ShoulderPitch", "ShoulderRoll", "ShoulderYaw", "Elbow", "WristRoll", "WristPitch", "WristYaw")
]
G1_HANDS = ["kLeftGripper", "kRightGripper"]
G1_URDF = example_robot_data("g1_description/urdf/g1_29dof_rev_1_0.urdf")  # that of unitree_ros
LIBERO_BASE = (-0.6, 0.0, 0.9)  # [m] of the arm in LIBERO's world, about

Columns = Mapping[str, np.ndarray]


def write_columns(root: Path, names: Mapping[str, Any], episodes: Sequence[Columns], fps: int = 20) -> Path:
    """Write columns (T, ...), by episode, each with the names that its feature has.

    Numbers become vectors, or arrays if they are (T, m, k); words and truth values (T,) and pictures (T, h, w, 3) stay
    what they are.
    """
    features = {column: _feature(values, names.get(column)) for column, values in episodes[0].items()}
    dataset = LeRobotDataset.create("lab/public", fps, features, root=root, use_videos=False)
    for columns in episodes:
        for t in range(len(next(iter(columns.values())))):
            dataset.add_frame({name: _value(rows[t]) for name, rows in columns.items()} | {"task": "move"})
        dataset.save_episode()
    dataset.finalize()
    return root


def _feature(values: np.ndarray, names: Any) -> dict[str, Any]:
    kind = values.dtype.kind
    if kind == "u":
        return {"dtype": "image", "shape": values.shape[1:], "names": ["height", "width", "channels"]}
    dtype = {"U": "string", "b": "bool"}.get(kind, "float32")
    return {"dtype": dtype, "shape": values.shape[1:] or (1,), "names": names}


def _value(row: Any) -> Any:
    if isinstance(row, np.str_):
        return str(row)
    return np.atleast_1d(row).astype(np.float32) if row.dtype.kind == "f" else np.atleast_1d(row)


def joint_paths(seed: int = 0, arm: Arm = PANDA) -> list[np.ndarray]:
    """Commanded joints (T, 7) [rad] by episode."""
    return paths(arm, seed, LENGTHS)


def lagged(commanded: np.ndarray) -> np.ndarray:
    """What was measured: each frame's values are the command of the frame before."""
    return np.concatenate([commanded[:1], commanded[:-1]])


def opening(length: int) -> np.ndarray:
    return np.linspace(0, 1, length)[:, None]


def pictures(length: int) -> np.ndarray:
    return np.tile(np.arange(length, dtype=np.uint8)[:, None, None, None], (SIZE, SIZE, 3))


def poses(q: np.ndarray, arm: Arm, rotations: str, base: Sequence[float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Poses (T, 3 + k) of the end effector at joints (T, n): position, then Euler angles or rotation vectors."""
    T_base_ee = kinematics_of(arm).fk_batch(q)
    R = Rotation.from_matrix(T_base_ee[:, :3, :3])
    turns = {
        "euler": partial(R.as_euler, "xyz"),
        "rotvec": R.as_rotvec,
        "quat": R.as_quat,
        "rot6d": lambda: T_base_ee[:, :3, :2].reshape(len(q), 6),
    }
    return np.hstack([T_base_ee[:, :3, 3] + np.array(base), turns[rotations]()])


def droid(root: Path, dropped: Sequence[str] = ()) -> Path:
    """LeRobot's port of DROID: joints and gripper in ``action``, with parts and other actions beside it."""
    axes = {"joint_position": DROID_JOINTS, "gripper_position": ["gripper"], "cartesian_position": EULER}
    names = {f"observation.state.{part}": {"axes": own} for part, own in axes.items()}
    axes |= {"joint_velocity": DROID_JOINTS, "gripper_velocity": ["gripper"], "cartesian_velocity": EULER}
    names |= {f"action.{part}": {"axes": own} for part, own in axes.items()}
    names |= {"action.original": {"axes": [*EULER, "gripper"]}, "camera_extrinsics.wrist_left": {"axes": EULER}}
    names |= {"action": {"axes": DROID}, "observation.state": {"axes": DROID}}
    episodes = []
    for q in joint_paths():
        length, grip = len(q), opening(len(q))
        measured = {"joint_position": lagged(q), "gripper_position": lagged(grip)}
        measured["cartesian_position"] = poses(lagged(q), PANDA, "euler")
        commanded = {"joint_position": q, "gripper_position": grip, "cartesian_position": poses(q, PANDA, "euler")}
        commanded |= {f"{part}_velocity": commanded[f"{part}_position"] for part in ("joint", "gripper", "cartesian")}
        commanded = {
            part: values - lagged(values) if "velocity" in part else values for part, values in commanded.items()
        }
        columns = {"is_first": np.arange(length) == 0, "language_instruction": np.full(length, "Move.")}
        columns |= {f"observation.state.{part}": values for part, values in measured.items()}
        columns["observation.state"] = np.hstack([lagged(q), lagged(grip)])
        columns["observation.images.wrist_left"] = pictures(length)
        columns |= {f"action.{part}": values for part, values in commanded.items()}
        columns["action.original"] = np.hstack([commanded["cartesian_velocity"], grip])
        columns["action"] = np.hstack([q, grip])
        columns |= {"discount": np.ones(length), "camera_extrinsics.wrist_left": np.zeros((length, 6))}
        episodes.append({name: rows for name, rows in columns.items() if name not in dropped})
    return write_columns(root, names, episodes, fps=15)


def openpi_droid(root: Path) -> Path:
    """DROID as openpi converts it: measured joints, velocities as actions, and names of columns for names of joints."""
    names = {name: [name] for name in ("joint_position", "gripper_position", "actions")}
    episodes = []
    for q in joint_paths():
        grip = opening(len(q))
        columns = {"wrist_image_left": pictures(len(q)), "joint_position": q, "gripper_position": lagged(grip)}
        episodes.append(columns | {"actions": np.hstack([q - lagged(q), grip])})
    return write_columns(root, names, episodes, fps=15)


def robomind(root: Path) -> Path:
    """RoboMIND's Frankas: joints and gripper of leader and follower, each in a column (any4lerobot)."""
    names = {f"{part}.joint_position": {"motors": DROID} for part in ("actions", "observation.states")}
    names["observation.states.end_effector"] = {"motors": ["x", "y", "z", "r", "p", "y"]}
    episodes = []
    for q in joint_paths():
        joints = np.hstack([q, opening(len(q))])
        columns = {"observation.images.camera_top": pictures(len(q)), "actions.joint_position": joints}
        columns["observation.states.end_effector"] = poses(lagged(q), PANDA, "euler")
        episodes.append(columns | {"observation.states.joint_position": lagged(joints)})
    return write_columns(root, names, episodes, fps=30)


def uma(root: Path) -> Path:
    """UMA Robots' Panda: poses of the end effector in ``action``, the commanded joints in a column beside it.

    The state begins with the joints; what else its 29 dimensions are called, and the camera, is not known here.
    """
    motors = [f"joint_{i}" for i in range(1, 8)]
    pose = [f"ee_{axis}.pos" for axis in ("x", "y", "z", "rx", "ry", "rz")]
    joints, torques = ([f"{motor}.{what}" for motor in (*motors, "gripper")] for what in ("pos", "torque"))
    state = [*joints, *(f"{motor}.vel" for motor in motors), *torques, *pose]
    names = {"action": [*pose, "gripper.pos"], "action.joint_position": joints, "action.joint_torque": torques}
    names["observation.state"] = state
    episodes = []
    for q in joint_paths():
        grip, torque = opening(len(q)), np.full((len(q), 8), 0.5)
        columns = {"action": np.hstack([poses(q, PANDA, "rotvec"), grip])}
        columns |= {"action.joint_position": np.hstack([q, grip]), "action.joint_torque": torque}
        measured = [lagged(q), lagged(grip), q - lagged(q), torque, poses(lagged(q), PANDA, "rotvec")]
        columns |= {"observation.state": np.hstack(measured), "observation.images.front": pictures(len(q))}
        episodes.append(columns)
    return write_columns(root, names, episodes, fps=10)


def beside_poses(root: Path) -> Path:
    """Poses with rot6d in ``action``, the joints in a column beside it."""
    pose = ["x", "y", "z", *(f"r{i}" for i in range(6)), "gripper"]
    names = {"action": pose, "action.joint_position": DROID_JOINTS, "observation.state": DROID}
    episodes = []
    for q in joint_paths():
        grip = opening(len(q))
        columns = {"action": np.hstack([poses(q, PANDA, "rot6d"), grip]), "action.joint_position": q}
        episodes.append(columns | {"observation.state": np.hstack([lagged(q), lagged(grip)])})
    return write_columns(root, names, episodes)


def libero(root: Path, arm: Arm = PANDA) -> Path:
    """LIBERO with its joints: changes of the end effector in ``action``, the joints in a column (any4lerobot)."""
    names = {"action": {"motors": [*AXIS_ANGLE, "gripper"]}}
    names |= {"observation.state": {"motors": [*AXIS_ANGLE, "gripper", "gripper"]}}
    names |= {"observation.states.ee_state": {"motors": AXIS_ANGLE}}
    names |= {"observation.states.joint_state": {"motors": DROID_JOINTS}}
    names |= {"observation.states.gripper_state": {"motors": ["gripper", "gripper"]}}
    episodes = []
    for q in joint_paths(arm=arm):
        columns = _libero(q, arm)
        state = columns.pop("state")
        columns |= {"observation.state": state, "observation.states.ee_state": state[:, :6]}
        columns |= {"observation.states.joint_state": q, "observation.states.gripper_state": state[:, 6:]}
        episodes.append(columns | {"observation.images.wrist_image": pictures(len(q))})
    return write_columns(root, names, episodes)


def plain_libero(root: Path, joints: bool = True, fps: int = 30) -> Path:
    """LIBERO as openpi converts it, without joints; with them, in ``joint_state``, as others do."""
    episodes = []
    for q in joint_paths():
        columns = _libero(q, PANDA)
        columns = {"wrist_image": pictures(len(q)), "state": columns["state"], "actions": columns["action"]}
        episodes.append(columns | ({"joint_state": q} if joints else {}))
    names = {} if joints else {name: [name] for name in ("state", "actions")}
    return write_columns(root, names, episodes, fps)


def _libero(q: np.ndarray, arm: Arm) -> dict[str, np.ndarray]:
    """LIBERO's deltas for its controller in [-1, 1] with a gripper, and its state: the pose and both fingers."""
    rng, grip = np.random.default_rng(len(q)), np.where(opening(len(q)) > 0.5, 1.0, 0.0)
    state = np.hstack([poses(q, arm, "rotvec", LIBERO_BASE), grip * 0.04, -grip * 0.04])
    return {"action": np.hstack([rng.uniform(-0.6, 0.6, (len(q), 6)), grip]), "state": state}


def xarm7(root: Path) -> Path:
    """An xArm7's joints in ``action``, with names in a list in a list."""
    names = {key: [[*(f"j{i}" for i in range(1, 8)), "gripper"]] for key in ("action", "observation.state")}
    episodes = []
    for q in joint_paths(arm=Arm.preset("xarm7")):
        joints = np.hstack([q, opening(len(q))])
        columns = {"action": joints, "observation.state": lagged(joints)}
        episodes.append(columns | {"observation.images.wrist": pictures(len(q))})
    return write_columns(root, names, episodes, fps=50)


def ucsd_kitchen(root: Path) -> Path:
    """An xArm7 of Open X-Embodiment: poses in ``action``, measured joints and padding in the state (any4lerobot)."""
    arm = Arm.preset("xarm7")
    names = {"action": {"motors": [*EULER, "gripper"]}}
    names["observation.state"] = {"motors": [f"motor_{i}" for i in range(8)]}
    episodes = []
    for q in joint_paths(arm=arm):
        columns = {"action": np.hstack([poses(q, arm, "euler"), opening(len(q))])}
        columns |= {"observation.state": np.hstack([q, np.zeros((len(q), 1))])}
        episodes.append(columns | {"observation.images.image": pictures(len(q))})
    return write_columns(root, names, episodes, fps=2)


def openarm(root: Path) -> Path:
    """Two OpenArms by LeRobot's driver, in degrees; the state has them the other way round."""
    motors = {side: [f"{side}_joint_{i}.pos" for i in range(1, 8)] + [f"{side}_gripper.pos"] for side in SIDES}
    names = {"action": [*motors["left"], *motors["right"]], "observation.state": [*motors["right"], *motors["left"]]}
    episodes = []
    arms = [Arm.preset(f"openarm_v2_{side}") for side in SIDES]
    for left, right in zip(*(joint_paths(seed, arm) for seed, arm in enumerate(arms)), strict=True):
        grip = -60 * opening(len(left))  # [deg]
        sides = [np.hstack([np.rad2deg(q), grip]) for q in (left, right)]
        columns = {"action": np.hstack(sides), "observation.state": lagged(np.hstack(sides[::-1]))}
        episodes.append(columns | {"observation.images.top": pictures(len(grip))})
    return write_columns(root, names, episodes, fps=30)


def unitree(root: Path, arms: Sequence[Arm] = (PANDA, PANDA)) -> Path:
    """Unitree's G1 with grippers: the names of all motors in a list in a list."""
    names = {key: [[*G1, *G1_HANDS]] for key in ("action", "observation.state")}
    episodes = []
    for left, right in zip(*(joint_paths(seed, arm) for seed, arm in enumerate(arms)), strict=True):
        motors = np.hstack([left, right, opening(len(left)), opening(len(left))])
        columns = {"action": motors, "observation.state": lagged(motors)}
        episodes.append(columns | {"observation.images.cam_left_wrist": pictures(len(left))})
    return write_columns(root, names, episodes, fps=30)


def agibot(root: Path, arms: Sequence[Arm] = (PANDA, PANDA), named: bool = True) -> Path:
    """AgiBot World: no ``action``, both arms in one column, grippers, head, waist and base in others (any4lerobot)."""
    motors = {"joint.position": [f"{side}_arm_{i}" for side in SIDES for i in range(7)]}
    motors |= {"effector.position": ["left_gripper", "right_gripper"], "head.position": ["yaw", "patch"]}
    motors |= {"end.orientation": ["left_xyzw", "right_xyzw"], "end.position": ["left_xyz", "right_xyz"]}
    motors |= {"waist.position": ["pitch", "lift"]}
    only = {"actions": {"robot.velocity": ["x_vel", "yaw_vel"]}, "observation.states": {}}
    names = {
        f"{start}.{part}": {"motors": own} for start, more in only.items() for part, own in (motors | more).items()
    }
    episodes = []
    for left, right in zip(*(joint_paths(seed, arm) for seed, arm in enumerate(arms)), strict=True):
        ends = np.stack([poses(q, arm, "quat") for q, arm in zip((left, right), arms, strict=True)], axis=1)
        still = np.tile([0.1, 0.2], (len(left), 1))
        values = {"joint.position": np.hstack([left, right]), "effector.position": np.hstack([opening(len(left))] * 2)}
        values |= {"end.position": ends[..., :3], "end.orientation": ends[..., 3:]}
        values |= {"head.position": still, "waist.position": still}
        columns = {f"actions.{part}": each for part, each in values.items()} | {"actions.robot.velocity": still}
        columns |= {f"observation.states.{part}": lagged(each) for part, each in values.items()}
        episodes.append(columns | {"observation.images.head": pictures(len(left))})
    return write_columns(root, names if named else {}, episodes, fps=30)


def g1_arms() -> list[Arm]:
    """The G1's left and right arm, at home where ERJ is well conditioned, unlike in the middle of their ranges."""
    found = []
    for side, sign in zip(SIDES, (1, -1), strict=True):
        home = np.array([0.25, 0.05 * sign, -1.05 * sign, -0.3, -0.5 * sign, -0.3, -0.8 * sign])
        found.append(Arm.from_urdf(G1_URDF, base_frame="torso_link", ee_frame=f"{side}_rubber_hand", home=home))
    return found


def write_agibot_arms(path: Path) -> list[Arm]:
    """Two Pandas under the names of Genie Sim's G01, as a URDF that stands in for it; returns both arms."""
    root = ET.Element("robot", name="stand_in")
    ET.SubElement(root, "link", name="arm_base_link")
    frames = []
    for side, number, y in (("l", 2, 0.3), ("r", 6, -0.3)):
        known = {f"panda_joint{i}": f"idx{number}{i}_arm_{side}_joint{i}" for i in range(1, 8)}
        known |= {"panda_link0": f"arm_{side}_base_link", "panda_hand_tcp": f"gripper_{side}_center_link"}
        mount = ET.SubElement(root, "joint", name=f"arm_{side}_base_joint", type="fixed")
        ET.SubElement(mount, "parent", link="arm_base_link")
        ET.SubElement(mount, "child", link=known["panda_link0"])
        ET.SubElement(mount, "origin", xyz=f"0 {y} 0")
        for element in ET.parse(PANDA.urdf).getroot():
            if element.tag == "link":
                ET.SubElement(root, "link", name=known.get(element.attrib["name"], f"{side}_{element.attrib['name']}"))
            elif element.tag == "joint":
                for each in element.iter():
                    names = {key: each.attrib[key] for key in ("name", "link", "joint") if key in each.attrib}
                    each.attrib |= {key: known.get(name, f"{side}_{name}") for key, name in names.items()}
                root.append(element)
        frames.append(known["panda_hand_tcp"])
    ET.ElementTree(root).write(path)
    return [Arm.from_urdf(path, base_frame="arm_base_link", ee_frame=frame) for frame in frames]


def older(source: Path, target: Path) -> Path:
    """A dataset as LeRobot wrote them in version 2.1: a file an episode, metadata in lines of JSON."""
    dataset = Dataset(source)
    info = json.loads((source / "meta/info.json").read_text())
    table = pq.read_table(source / "data")
    (target / "data/chunk-000").mkdir(parents=True)
    (target / "meta").mkdir()
    episodes, stats = [], []
    numbers = [name for name, each in dataset.features.items() if each["dtype"].startswith(("float", "int"))]
    cameras = [name for name, each in dataset.features.items() if each["dtype"] == "image"]
    for number, rows in dataset.episodes.items():
        pq.write_table(
            table.slice(rows.start, rows.stop - rows.start), target / f"data/chunk-000/episode_{number:06d}.parquet"
        )
        episodes.append({"episode_index": number, "tasks": ["move"], "length": rows.stop - rows.start})
        grey = np.full((3, 1, 1), 0.5).tolist()
        of_columns: dict[str, Any] = {
            name: dict.fromkeys(("min", "max", "mean", "std"), grey) | {"count": [1]} for name in cameras
        }
        for name in numbers:
            values = dataset.column(name)[rows].astype(np.float64)
            of_columns[name] = {
                each: getattr(np, each)(values, axis=0).tolist() for each in ("min", "max", "mean", "std")
            }
            of_columns[name]["count"] = [len(values)]
        stats.append({"episode_index": number, "stats": of_columns})
    lines = {"episodes": episodes, "episodes_stats": stats, "tasks": [{"task_index": 0, "task": "move"}]}
    for name, entries in lines.items():
        (target / f"meta/{name}.jsonl").write_text("".join(json.dumps(each) + "\n" for each in entries))
    info |= {"codebase_version": "v2.1", "total_chunks": 1, "total_videos": 0}
    info["data_path"] = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
    (target / "meta/info.json").write_text(json.dumps(info))
    return target
