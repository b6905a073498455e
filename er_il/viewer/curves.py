"""The numbers of an episode as curves: joints, end effector, redundancy, action against measured."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import rerun as rr
from scipy.spatial.transform import Rotation

from er_il.evaluation.trace import Array, Trace
from er_il.kinematics.arm_angle import ArmAngle
from er_il.kinematics.solver import Status
from er_il.spaces.action_space import ActionSpace
from er_il.spaces.delta import DeltaBounds, DeltaSpace

JOINTS, END_EFFECTOR, REDUNDANCY, ACTION = GROUPS = ("joints", "end_effector", "redundancy", "action")
STATUS = "status"
ARM_ANGLE = "arm_angle"
PATH = "path"
MEASURED, COMMAND, ERROR = "measured", "command", "error"

PATH_WIDTH = -1.5  # negative: in points of the screen, not metres

# Okabe and Ito's colours, told apart by colour-blind people too.
COLOURS = {MEASURED: (0, 114, 178), COMMAND: (230, 159, 0), ACTION: (230, 159, 0), ERROR: (213, 94, 0)}
STATUS_COLOURS = {
    Status.OK: (0, 158, 115),
    Status.LIMIT: (240, 228, 66),
    Status.JUMP: (230, 159, 0),
    Status.NOT_CONVERGED: (204, 121, 167),
    Status.UNREACHABLE: (213, 94, 0),
    Status.INVALID: (150, 0, 0),
}


@dataclass(frozen=True)
class Curve:
    """One quantity over an episode, seen from several sides."""

    group: str
    name: str
    unit: str
    series: Mapping[str, Array]  # each (T,)

    @property
    def path(self) -> str:
        """Entity under which its series lie."""
        return f"{self.group}/{self.name}"


def curves_of(trace: Trace, space: ActionSpace) -> list[Curve]:
    """Work out every curve of an episode whose actions are of that space."""
    joints = list(zip(trace.joint_names, trace.q.T, trace.command.T, strict=True))
    curves = [Curve(JOINTS, name, "rad", {MEASURED: q, COMMAND: command}) for name, q, command in joints]
    T_measured, T_command = (space.kinematics.fk_batch(q) for q in (trace.q, trace.command))
    for i, axis in enumerate("xyz"):
        series = {MEASURED: T_measured[:, i, 3], COMMAND: T_command[:, i, 3]}
        curves.append(Curve(END_EFFECTOR, axis, "m", series))
    gap = np.linalg.norm(T_command[:, :3, 3] - T_measured[:, :3, 3], axis=1)
    turn = Rotation.from_matrix(T_measured[:, :3, :3]).inv() * Rotation.from_matrix(T_command[:, :3, :3])
    curves.append(Curve(END_EFFECTOR, "position_error", "m", {ERROR: gap}))
    curves.append(Curve(END_EFFECTOR, "rotation_error", "rad", {ERROR: turn.magnitude()}))
    curves += [
        Curve(REDUNDANCY, name, "rad", {MEASURED: q, COMMAND: command})
        for name, q, command in joints
        if name in space.arm.redundant
    ]
    if space.arm.angle_frames is not None and space.arm.redundancy:
        curves.append(_arm_angle(trace, space))
    measured = _unbounded(space).encode(trace.q, trace.gripper)
    for name, seen, asked in zip(trace.action_names, measured.T, trace.action.T, strict=True):
        curves.append(Curve(ACTION, name, "", {MEASURED: seen, ACTION: asked}))
    return curves


def _unbounded(space: ActionSpace) -> ActionSpace:
    """The space, of changes without their bounds: an arm that was late may move farther in a step than commanded."""
    if not isinstance(space.arm_space, DeltaSpace):
        return space
    return ActionSpace(replace(space.arm_space, delta_bounds=DeltaBounds(np.inf, np.inf, np.inf)))


def _arm_angle(trace: Trace, space: ActionSpace) -> Curve:
    """The arm angle without jumps at half a turn, the command on the measured one's turn."""
    measured, command = (ArmAngle(space.arm).wrapped(q) for q in (trace.q, trace.command))
    apart = (command - measured + np.pi) % (2 * np.pi) - np.pi
    continuous: Array = np.unwrap(measured).astype(np.float64)
    return Curve(REDUNDANCY, ARM_ANGLE, "rad", {MEASURED: continuous, COMMAND: continuous + apart})


def log_curves(recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], curves: Sequence[Curve]) -> None:
    """Log each series of each curve as a column of its own entity."""
    for curve in curves:
        for name, values in curve.series.items():
            path = f"{curve.path}/{name}"
            style = rr.SeriesLines(names=name, colors=COLOURS[name], widths=2.5 if name == MEASURED else 1.5)
            recording.log(path, style, static=True)
            recording.send_columns(path, times, rr.Scalars.columns(scalars=values))


def log_status(recording: rr.RecordingStream, times: Sequence[rr.TimeColumn], trace: Trace) -> None:
    """Log what became of each decoded action."""
    style = rr.StateConfiguration(
        values=[str(status) for status in STATUS_COLOURS], colors=list(STATUS_COLOURS.values())
    )
    recording.log(STATUS, style, static=True)
    recording.send_columns(STATUS, times, rr.StateChange.columns(state=list(trace.status)))


def log_path(recording: rr.RecordingStream, trace: Trace, space: ActionSpace) -> None:
    """Draw the end effector's way through space, as measured and as commanded."""
    for name, q in ((MEASURED, trace.q), (COMMAND, trace.command)):
        line = space.kinematics.fk_batch(q)[:, :3, 3]
        recording.log(
            f"{PATH}/{name}",
            rr.LineStrips3D([line], colors=[COLOURS[name]], radii=[PATH_WIDTH]),
            static=True,
        )
