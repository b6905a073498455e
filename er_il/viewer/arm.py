"""The arm in Rerun: its URDF's shapes once, and one transform column a joint."""

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
from rerun.urdf import UrdfJoint, UrdfTree

from er_il.arms.arm import Arm
from er_il.arms.urdf import find_mesh, parse_urdf
from er_il.evaluation.trace import Array
from er_il.kinematics.solver import kinematics_of

ARM = "arm"
BONES = f"{ARM}/bones"  # of an arm without shapes, as those that travel with their data
FIXED = f"{ARM}/fixed"  # transforms of the URDF at rest
JOINTS = f"{ARM}/joints"
ROOT_FRAME = "tf#/"  # Rerun's name for the frame of the whole recording: the arm's base
BONE_RADIUS = 0.01  # [m]
COLOUR = (0.85, 0.87, 0.9, 1.0)


def log_arm(
    recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], arm: Arm, q: Array, gripper: Array
) -> UrdfTree:
    """Log the arm moving through q (T, n) [rad], its gripper opening to (T,) in [0, 1].

    Prismatic joints beyond the arm's last joint are the gripper's: closed at their lower limit,
    open at their upper one.

    Raises:
        ArmError: a mesh of the URDF is missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / arm.urdf.name
        urdf.write_text(drawable_urdf(arm.urdf))
        tree = UrdfTree.from_file_path(urdf, ARM, static_transform_entity_path=FIXED)
        tree.log_urdf_to_recording(recording)
    if not any(tree.get_visual_geometry_paths(joint.child_link) for joint in tree.joints()):
        _log_bones(recording, tree.joints())
    root = tree.root_link().name
    T_base_root = kinematics_of(arm).frame_pose(np.zeros(arm.dof), root)
    recording.log(
        f"{ARM}/base",
        rr.Transform3D(
            translation=T_base_root[:3, 3],
            mat3x3=T_base_root[:3, :3],
            parent_frame=ROOT_FRAME,
            child_frame=root,
        ),
        static=True,
    )
    joints = {joint.name: joint for joint in tree.joints()}
    angles = dict(zip(arm.joints, q.T, strict=True))
    for joint in _beyond(list(joints.values()), joints[arm.joints[-1]]):
        if joint.joint_type == "prismatic":
            angles[joint.name] = joint.limit_lower + gripper * (joint.limit_upper - joint.limit_lower)
    for name, values in angles.items():
        recording.send_columns(
            f"{JOINTS}/{name}", times, joints[name].compute_transform_columns(values.tolist(), clamp=False)
        )
    return tree


def drawable_urdf(path: Path) -> str:
    """The URDF with absolute mesh paths, every link drawn by its collision shapes where it has any.

    Collision shapes are simplified: a recording of 0.3 MB instead of 7.

    Raises:
        ArmError: a mesh is missing.
    """
    robot = parse_urdf(path)
    for link in robot.findall("link"):
        visuals, collisions = link.findall("visual"), link.findall("collision")
        for shape in (visuals if collisions else []) + collisions:
            link.remove(shape)
        for shape in collisions or []:
            shape.tag = "visual"
            material = ET.SubElement(shape, "material", name="arm")
            ET.SubElement(material, "color", rgba=" ".join(map(str, COLOUR)))
            link.append(shape)
    for mesh in robot.iter("mesh"):
        mesh.set("filename", str(find_mesh(mesh.get("filename", ""), path)))
    return ET.tostring(robot, encoding="unicode")


def _log_bones(recording: rr.RecordingStream, joints: Sequence[UrdfJoint]) -> None:
    """Draw a line from each link's origin to the next ones'."""
    for joint in joints:
        line = rr.LineStrips3D([[(0.0, 0.0, 0.0), joint.origin_xyz]], radii=[BONE_RADIUS], colors=[COLOUR])
        recording.log(f"{BONES}/{joint.name}", line, rr.CoordinateFrame(joint.parent_link), static=True)


def _beyond(joints: Sequence[UrdfJoint], last: UrdfJoint) -> list[UrdfJoint]:
    """Joints that the last arm joint carries."""
    found: list[UrdfJoint] = []
    links = {last.child_link}
    while more := [joint for joint in joints if joint.parent_link in links and joint.child_link not in links]:
        found += more
        links |= {joint.child_link for joint in more}
    return found
