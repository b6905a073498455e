"""Where a recording goes: a file, a viewer on this screen, or a browser anywhere."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from urllib.parse import quote

import rerun as rr

from er_il.display import has_display
from er_il.errors import ErIlError
from er_il.scene import Shape
from er_il.trace import Trace
from er_il.viewer.recording import View, view_of
from er_il.viewer.source import shapes_of

SUFFIX = ".rrd"  # by which Rerun knows its files
GRPC_PORT, WEB_PORT = 9876, 9090  # Rerun's own


def save_rollout(trace: Trace, path: Path) -> None:
    """Write a rollout as :func:`save_recording` does, in the world of its task."""
    save_recording(trace, shapes_of(trace), path)


def save_recording(trace: Trace, shapes: Sequence[Shape], path: Path) -> None:
    """Write an episode as a file for Rerun; the file is whole or absent.

    Raises:
        ErIlError: the path does not end in ``.rrd``, or the file cannot be written.
    """
    if path.suffix != SUFFIX:
        raise ErIlError(f"Rerun knows its files by {SUFFIX}; {path} ends in {path.suffix or 'nothing'}.")
    view = view_of(trace, shapes)
    # Not by Rerun's own save: on a full disk that one waits for ever.
    memory = view.recording.memory_recording()
    view.recording.send_blueprint(view.layout)
    partial = path.with_name(path.name + ".partial")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_bytes(memory.drain_as_bytes())
        partial.rename(path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        raise ErIlError(f"Cannot write {path}: {error.strerror}.") from error


def require_display() -> None:
    """Refuse to go on without a screen.

    Raises:
        ErIlError: there is none.
    """
    if not has_display():
        raise ErIlError(
            "There is no display for the viewer. Use --save FILE.rrd and open the file with `rerun` elsewhere, "
            "or --serve and look at it in a browser."
        )


def spawn(view: View) -> None:
    """Open the viewer on this screen; it stays open when this process ends."""
    view.recording.spawn(default_blueprint=view.layout)
    view.recording.flush()


def serve(view: View) -> str:
    """Serve the recording and a viewer for browsers until this process ends; return the address."""
    uri = view.recording.serve_grpc(grpc_port=GRPC_PORT, default_blueprint=view.layout)
    rr.serve_web_viewer(web_port=WEB_PORT, open_browser=has_display(), connect_to=uri)
    return f"http://localhost:{WEB_PORT}?url={quote(uri)}"
