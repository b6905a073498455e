"""The arm's surroundings in Rerun: the scene's shapes, the objects' motion, the cameras."""

import io
from collections.abc import Sequence

import numpy as np
import rerun as rr
from PIL import Image
from scipy.spatial.transform import Rotation

from er_il.evaluation.trace import Trace
from er_il.support.shapes import Shape, object_poses

SCENE = "scene"
CAMERAS = "cameras"
FIXTURES = "fixtures"  # shapes that never move
JPEG_QUALITY = 90


def log_scene(
    recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], trace: Trace, shapes: Sequence[Shape]
) -> None:
    """Log the shapes, and the poses of those that the environment state moves."""
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for shape in shapes:
        path = f"{SCENE}/{shape.parent or FIXTURES}/{shape.name}"
        rotation = Rotation.from_matrix(shape.T_parent_shape[:3, :3]).as_quat()
        pose = rr.Transform3D(translation=shape.T_parent_shape[:3, 3], quaternion=rr.Quaternion(xyzw=rotation))
        recording.log(path, pose, _solid(shape), static=True)
    for name in sorted({shape.parent for shape in shapes} - {""}):
        poses = object_poses(name, trace.environment_state, trace.environment_state_names)
        if poses is not None:
            columns = rr.Transform3D.columns(translation=poses[0], quaternion=poses[1])
            recording.send_columns(f"{SCENE}/{name}", times, columns)


def log_cameras(recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], trace: Trace) -> None:
    """Log what each camera saw."""
    for camera, frames in trace.images.items():
        columns = rr.EncodedImage.columns(
            blob=[_jpeg(frame) for frame in frames], media_type=["image/jpeg"] * len(frames)
        )
        recording.send_columns(f"{CAMERAS}/{camera}", times, columns)


def _solid(shape: Shape) -> rr.AsComponents:
    solid = rr.components.FillMode.Solid
    match shape.kind:
        case "box":
            return rr.Boxes3D(half_sizes=[shape.size], colors=[shape.rgba], fill_mode=solid)
        case "sphere":
            return rr.Ellipsoids3D(half_sizes=[shape.size[:1] * 3], colors=[shape.rgba], fill_mode=solid)
        case "ellipsoid":
            return rr.Ellipsoids3D(half_sizes=[shape.size], colors=[shape.rgba], fill_mode=solid)
        case "cylinder":
            radius, half = shape.size[:2]
            return rr.Cylinders3D(lengths=[2 * half], radii=[radius], colors=[shape.rgba], fill_mode=solid)
        case "capsule":
            radius, half = shape.size[:2]  # Rerun's starts at its origin, ours is centred there
            return rr.Capsules3D(
                lengths=[2 * half], radii=[radius], translations=[[0, 0, -half]], colors=[shape.rgba], fill_mode=solid
            )
        case "mesh":
            assert shape.vertices is not None and shape.faces is not None
            return rr.Mesh3D(
                vertex_positions=shape.vertices,
                vertex_normals=_normals(shape.vertices, shape.faces),
                triangle_indices=shape.faces,
                albedo_factor=shape.rgba,
            )


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals (V, 3): the mean of the faces around each vertex, by area."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(b - a, c - a))
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def _jpeg(frame: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(frame).save(buffer, "JPEG", quality=JPEG_QUALITY)
    return buffer.getvalue()
