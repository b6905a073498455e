"""Rerun's server of an episode for browsers: on this machine alone, unless another address is asked for."""

import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from ipaddress import ip_address
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

import rerun_cli

from er_il.evaluation.trace import Trace
from er_il.support.errors import ErIlError
from er_il.support.shapes import Shape
from er_il.support.workers import end_with_parent
from er_il.viewer.show import save_recording

GRPC_PORT, WEB_PORT = 9876, 9090  # Rerun's own
PATIENCE = 30.0  # [s] until the server answers


@contextmanager
def served(trace: Trace, shapes: Sequence[Shape], address: str) -> Iterator[str]:
    """Serve an episode and a viewer for browsers inside the block; yield the URL of the viewer.

    Args:
        trace: The episode.
        shapes: Shapes of its world.
        address: IP address of this machine to listen on; ``127.0.0.1`` is reached from this machine only.

    Raises:
        ErIlError: the server cannot listen there.
    """
    host = "localhost" if ip_address(address).is_unspecified else address
    with TemporaryDirectory() as folder:
        file, log = Path(folder) / "episode.rrd", Path(folder) / "log.txt"
        save_recording(trace, shapes, file)
        ports = _free(GRPC_PORT, address), _free(WEB_PORT, address)
        # The SDK's servers listen on every address of the machine; only Rerun's program can be told otherwise.
        command = [str(Path(rerun_cli.__file__).with_name("rerun")), str(file), "--serve-web", "--bind", address]
        command += ["--port", str(ports[0]), "--web-viewer-port", str(ports[1])]
        with (
            log.open("wb") as output,
            subprocess.Popen(command, stdout=output, stderr=output, preexec_fn=end_with_parent) as server,
        ):
            try:
                _wait(server, address, ports, log)
                yield f"http://{_written(host)}:{ports[1]}?url={quote(f'rerun+http://{_written(host)}:{ports[0]}/proxy')}"
            finally:
                server.terminate()


def _wait(server: "subprocess.Popen[bytes]", address: str, ports: Sequence[int], log: Path) -> None:
    """Return as soon as the server listens."""
    waiting, deadline = list(ports), time.monotonic() + PATIENCE
    while waiting:
        if server.poll() is not None or time.monotonic() > deadline:
            said = log.read_text(errors="replace").strip().splitlines()
            raise ErIlError(f"Rerun's server cannot listen on {address}: {said[-1] if said else 'no answer'}")
        try:
            socket.create_connection((address, waiting[0]), timeout=1.0).close()
            waiting.pop(0)
        except OSError:
            time.sleep(0.05)


def _free(port: int, address: str) -> int:
    """That port, or another one if something listens there.

    Raises:
        ErIlError: the address is none of this machine's.
    """
    family = socket.AF_INET6 if ip_address(address).version == 6 else socket.AF_INET
    for candidate in (port, 0):
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, candidate))
                return probe.getsockname()[1]
            except OSError as error:
                reason = error.strerror
    raise ErIlError(f"Cannot listen on {address}: {reason}.")


def _written(host: str) -> str:
    """A host as a URL writes it."""
    return f"[{host}]" if ":" in host else host
