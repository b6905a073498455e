"""Destinations of a recording: a file, a viewer on this screen, or a browser."""

import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import quote

import rerun as rr

from er_il.evaluation.trace import Trace
from er_il.support.atomic_files import write_atomically
from er_il.support.display import has_display
from er_il.support.errors import ErIlError
from er_il.support.shapes import Shape
from er_il.viewer.destination import check_file
from er_il.viewer.recording import log_episode, open_recording
from er_il.viewer.source import shapes_of

GRPC_PORT, WEB_PORT = 9876, 9090  # Rerun's own


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


@contextmanager
def served(trace: Trace, shapes: Sequence[Shape]) -> Iterator[str]:
    """Serve an episode and a viewer for browsers inside the block; yield the address."""
    recording = open_recording(trace)
    uri = recording.serve_grpc(grpc_port=_free(GRPC_PORT))
    port = _free(WEB_PORT)
    rr.serve_web_viewer(web_port=port, open_browser=has_display(), connect_to=uri)
    log_episode(recording, trace, shapes)
    try:
        yield f"http://localhost:{port}?url={quote(uri)}"
    finally:
        recording.disconnect()


def _free(port: int) -> int:
    """That port, or another one if something listens there."""
    with socket.socket() as candidate:
        candidate.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            candidate.bind(("", port))
        except OSError:
            candidate.bind(("", 0))
        return candidate.getsockname()[1]
