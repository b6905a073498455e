"""The recording of an episode, put together from its parts."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from er_il.arms.portable import arm_from_spec
from er_il.evaluation.trace import Trace
from er_il.kinematics.solver import Status
from er_il.spaces.action_space import from_spec
from er_il.support.shapes import Shape
from er_il.viewer.arm import log_arm
from er_il.viewer.blueprint import ABOUT, FRAME, TIME, blueprint
from er_il.viewer.curves import curves_of, log_curves, log_path, log_status
from er_il.viewer.world import log_cameras, log_scene

APPLICATION = "er_il"


def open_recording(trace: Trace) -> rr.RecordingStream:
    """Make the recording of an episode. Give it a sink (a file, a viewer) first, then log.

    Rerun's server waits for ever for a recording that was logged before.
    """
    # Nothing is logged with the clock: the only times are the episode's own.
    return rr.RecordingStream(APPLICATION, recording_id=_name(trace), send_properties=False)


def log_episode(recording: rr.RecordingStream, trace: Trace, shapes: Sequence[Shape] = ()) -> None:
    """Log an episode and how to lay it out; equal episodes give equal recordings.

    Args:
        recording: See :func:`open_recording`.
        trace: The episode.
        shapes: The world around the arm.

    Raises:
        SpecError: the trace's action space does not fit the arm.
        ArmError: a mesh of the arm is missing.
    """
    space = from_spec(trace.spec, arm_from_spec(trace.spec["arm"]))
    curves = curves_of(trace, space)
    recording.send_blueprint(blueprint(curves, list(trace.images)))
    times = [rr.TimeColumn(FRAME, sequence=np.arange(len(trace))), rr.TimeColumn(TIME, duration=trace.times)]
    log_arm(recording, times, space.arm, trace.q, trace.gripper)
    log_scene(recording, times, trace, shapes)
    log_cameras(recording, times, trace)
    log_path(recording, trace, space)
    log_curves(recording, times, curves)
    log_status(recording, times, trace)
    recording.log(ABOUT, rr.TextDocument(_about(trace), media_type=rr.MediaType.MARKDOWN), static=True)


def _name(trace: Trace) -> str:
    return f"{trace.task or 'episode'}-{trace.label}-{trace.seed}"


def _about(trace: Trace) -> str:
    failed = sum(status != Status.OK for status in trace.status)
    rows = {
        "Task": trace.task or "unknown",
        "Seed": trace.seed,
        "Who acted": trace.label,
        "Outcome": trace.outcome or "unknown",
        "Action space": trace.spec["space"],
        "Arm": f"{trace.spec['arm']['name']} ({len(trace.joint_names)} joints)",
        "Control steps": f"{len(trace)} at {1 / trace.period:g} Hz",
        "Decodes with a status": f"{failed} of {len(trace)}",
    }
    return "\n".join(["| | |", "|---|---|", *(f"| **{key}** | {value} |" for key, value in rows.items())])
