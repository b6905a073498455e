"""Destinations of a recording: a file, or a viewer on this screen."""

from collections.abc import Sequence
from pathlib import Path

from er_il.evaluation.trace import Trace
from er_il.support.atomic_files import write_atomically
from er_il.support.errors import ErIlError
from er_il.support.shapes import Shape
from er_il.viewer.destination import check_file
from er_il.viewer.recording import log_episode, open_recording
from er_il.viewer.source import shapes_of


def save_rollout(trace: Trace, path: Path) -> None:
    """Write a rollout as :func:`save_recording` does, in the world of its task."""
    save_recording(trace, shapes_of(trace), path)


def save_recording(trace: Trace, shapes: Sequence[Shape], path: Path) -> None:
    """Write an episode as a file for Rerun; the file is whole or absent.

    Raises:
        ErIlError: the path does not end in ``.rrd``, or the file cannot be written.
    """
    check_file(path)
    recording = open_recording(trace)
    memory = recording.memory_recording()  # Rerun's own way to a file waits for ever if the disk is full
    log_episode(recording, trace, shapes)
    try:
        write_atomically(path, lambda partial: partial.write_bytes(memory.drain_as_bytes()))
    except OSError as error:
        raise ErIlError(f"Cannot write {path}: {error.strerror}.") from error


def spawn(trace: Trace, shapes: Sequence[Shape]) -> None:
    """Open the viewer on this screen; it stays open when this process ends."""
    recording = open_recording(trace)
    recording.spawn()
    log_episode(recording, trace, shapes)
    recording.flush()
