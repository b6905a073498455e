"""What a command takes: ``python usage.py LOG COMMAND ...`` prints it as JSON; what the command prints goes to the log.

A program of its own that imports little, because Linux counts the memory of a process that starts another as that of
the other one, too. Linux only.
"""

import contextlib
import ctypes
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

_SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER


def usage(command: Sequence[str], log: Path) -> dict[str, float]:
    """Run a command until it and all its descendants have ended.

    Returns:
        ``cpu_s`` of them all, ``wall_s``, and ``peak_memory_mb`` of the largest process.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    # A descendant that survives its parent, such as LeRobot's fork server, becomes a child of this process.
    ctypes.CDLL(None).prctl(_SUBREAPER, 1)
    cpu, peak, started = 0.0, 0, time.monotonic()
    with log.open("w") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output)
    with contextlib.suppress(ChildProcessError):  # no descendant is left
        while True:
            pid, status, used = os.wait4(-1, 0)
            cpu, peak = cpu + used.ru_utime + used.ru_stime, max(peak, used.ru_maxrss)
            if pid == process.pid:
                process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command, log.read_text())
    wall = time.monotonic() - started
    return {"cpu_s": round(cpu, 2), "wall_s": round(wall, 2), "peak_memory_mb": round(peak * 1024 / 1e6, 1)}


if __name__ == "__main__":
    print(json.dumps(usage(sys.argv[2:], Path(sys.argv[1]))))
