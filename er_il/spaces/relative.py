"""Chunk-relative actions: a policy sees, and predicts, each action of a chunk relative to the state at its start.

All actions of a chunk count from one state, that of the observation from which the chunk is predicted. A pose is taken
on SE(3), in the frame of the measured end effector: with ``T_base_now`` at the chunk's start, a command ``T_base_goal``
is ``T_now_goal = T_base_now^-1 T_base_goal``. Joints and redundancy values are differences, angles the shortest ones.
What belongs to no arm, such as a gripper, stays absolute.

Datasets, environments and robots have absolute actions throughout; the policy's processors convert.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.kinematics.rotation import Quaternion, RotationCode
from er_il.spaces.layout import Layout, Part
from er_il.spaces.pose import POSITION_NAMES, PoseSpace
from er_il.support.errors import ErIlError, ShapeError

Array = NDArray[np.float64]
Floats = NDArray[np.floating]

_XYZ = slice(len(POSITION_NAMES))


@dataclass(frozen=True, eq=False)
class RelativeActions:
    """Converts chunks of a layout's encoded vectors: B chunks of T actions, each relative to its state.

    Numbers that are none, or an action whose rotation is none, give NaN in that arm's part of the action.

    Raises:
        ErIlError: the state does not measure all arms' joints, or the layout's actions are changes.
    """

    layout: Layout
    state_names: tuple[str, ...]

    def __post_init__(self) -> None:
        needed = [name for part in self.layout.parts for name in part.motors.measured]
        if missing := [name for name in needed if name not in self.state_names]:
            raise ErIlError(
                f"Actions relative to the state need the measured joints {', '.join(missing)} in it; "
                f"it has {', '.join(self.state_names) or 'nothing'}."
            )
        if any(part.space.relative for part in self.layout.parts):
            raise ErIlError(f"{self.layout.commands} actions are changes already.")

    def relative(self, actions: ArrayLike, states: ArrayLike) -> Array:
        """Take absolute actions (B, T, E) relative to states (B, S)."""
        return self._converted(actions, states, to_relative=True)

    def absolute(self, actions: ArrayLike, states: ArrayLike) -> Array:
        """The inverse of :meth:`relative`: absolute actions (B, T, E), from those relative to states (B, S)."""
        return self._converted(actions, states, to_relative=False)

    def _converted(self, actions: ArrayLike, states: ArrayLike, *, to_relative: bool) -> Array:
        chunks, measured = np.array(actions, dtype=np.float64), np.asarray(states, dtype=np.float64)
        width, known = len(self.layout.encoded_names), len(self.state_names)
        if chunks.ndim != 3 or chunks.shape[-1] != width:
            raise ShapeError("Chunks of actions", chunks.shape, f"(B, T, {width})")
        if measured.shape != (len(chunks), known):
            raise ShapeError("The states", measured.shape, f"({len(chunks)}, {known}): {', '.join(self.state_names)}")
        for part, columns, joints in self._parts:
            space, own = part.space, chunks[..., columns]
            if isinstance(space, PoseSpace):
                q = part.motors.angles(measured[:, joints])
                converted = _relative_poses(space, own, q) if to_relative else _absolute_poses(space, own, q)
            else:
                converted = own + (-1 if to_relative else 1) * measured[:, None, joints]
            chunks[..., columns] = converted
        return chunks

    @cached_property
    def _parts(self) -> list[tuple[Part, list[int], list[int]]]:
        """Each arm, its columns of the encoded vectors, and its joints' of the state."""
        names = self.layout.encoded_names
        return [
            (
                part,
                [
                    names.index(name)
                    for name in (part.names if isinstance(part.space, PoseSpace) else part.motors.joints)
                ],
                [self.state_names.index(name) for name in part.motors.measured],
            )
            for part in self.layout.parts
        ]


def _relative_poses(space: PoseSpace, actions: Array, q: Array) -> Array:
    """Actions (B, T, dim) of an arm relative to its joints q (B, n) [rad]."""
    T_base_now, values, finite = _present(space, q)
    R_base_goal, sound = _rotations(space.rotation, actions)
    R_now_base = T_base_now[:, None, :3, :3].swapaxes(-2, -1)
    p_now_goal = (R_now_base @ (actions[..., _XYZ] - T_base_now[:, None, :3, 3])[..., None])[..., 0]
    changes = _differences(space, values, actions[..., _end(space) :])
    turns = relative_code(space.rotation).encode(R_now_base @ R_base_goal)
    return _where(sound & finite[:, None], p_now_goal, turns, changes)


def _absolute_poses(space: PoseSpace, actions: Array, q: Array) -> Array:
    """The inverse of :func:`_relative_poses`."""
    T_base_now, values, finite = _present(space, q)
    R_now_goal, sound = _rotations(relative_code(space.rotation), actions)
    R_base_now = T_base_now[:, None, :3, :3]
    p_base_goal = (R_base_now @ actions[..., _XYZ, None])[..., 0] + T_base_now[:, None, :3, 3]
    rotations = space.rotation.encode(R_base_now @ R_now_goal)
    return _where(sound & finite[:, None], p_base_goal, rotations, values[:, None] + actions[..., _end(space) :])


def relative_code(rotation: RotationCode) -> RotationCode:
    """The code of relative rotations, which are near the identity: that is where a quaternion's hemisphere is."""
    return Quaternion() if isinstance(rotation, Quaternion) else rotation


def _present(space: PoseSpace, q: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Poses (B, 4, 4) and redundancy values (B, m) at q (B, n) [rad], and a mask (B,) of those that are finite."""
    finite: NDArray[np.bool_] = np.all(np.isfinite(q), axis=1)
    known = np.where(finite[:, None], q, space.arm.home)
    return space.kinematics.fk_batch(known), space.redundancy_along(known), finite


def _rotations(code: RotationCode, actions: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Rotation matrices (B, T, 3, 3) of actions (B, T, dim), and a mask (B, T) of the actions that have one."""
    rows = actions[..., len(POSITION_NAMES) : len(POSITION_NAMES) + len(code.names)]
    shape = rows.shape[:2]
    R, rotates = code.decode_batch(np.nan_to_num(rows).reshape(-1, rows.shape[-1]).T, np)
    sound = rotates & np.isfinite(rows).all(axis=-1).ravel()
    R = np.where(sound, R, np.eye(3)[..., None])
    return np.moveaxis(R, -1, 0).reshape(*shape, 3, 3), sound.reshape(shape)


def _differences(space: PoseSpace, values: Array, commanded: Array) -> Array:
    """Changes (B, T, m) that lead from redundancy values (B, m) to commanded ones (B, T, m)."""
    if space.redundancy is None:
        return commanded
    return space.redundancy.difference(values[:, None], commanded)


def _where(sound: NDArray[np.bool_], *columns: Array) -> Array:
    return np.where(sound[..., None], np.concatenate(columns, axis=-1), np.nan)


def _end(space: PoseSpace) -> int:
    """Number of dimensions of the pose."""
    return len(POSITION_NAMES) + len(space.rotation.names)


def relative_samples(convert: RelativeActions, actions: Floats, states: Floats) -> Array:
    """All actions (N, E) of all chunks of an episode, relative to their states: what its statistics are over.

    LeRobot fills a chunk that reaches beyond an episode's end with its last action, and masks those in the loss of
    most policies; they are not among these.

    Args:
        convert: What the vectors mean, and how long chunks are.
        actions: (T, E) absolute actions of the episode in time order.
        states: (T, S) the states measured when they were commanded.
    """
    count, chunk = len(actions), convert.layout.chunk
    rows = np.arange(count)[:, None] + np.arange(chunk)
    chunks = convert.relative(actions[np.minimum(rows, count - 1)], states)
    return chunks[rows < count]
