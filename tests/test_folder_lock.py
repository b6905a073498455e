"""A folder in which one command at a time works."""

import subprocess
import sys
from pathlib import Path

import pytest

from er_il.support.errors import ErIlError
from er_il.support.folder_lock import folder_lock

HOLDER = """
import sys, time
from pathlib import Path
from er_il.support.folder_lock import folder_lock
with folder_lock(Path(sys.argv[1])):
    print("in", flush=True)
    time.sleep(60)
"""


def test_a_second_command_is_refused_until_the_first_has_ended_however_it_ends(tmp_path: Path) -> None:
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE)
    try:
        assert holder.stdout
        assert holder.stdout.readline() == b"in\n"
        with (
            pytest.raises(ErIlError, match=r"Another command works in .*choose another --out"),
            folder_lock(tmp_path),
        ):
            pass
    finally:
        holder.kill()
        holder.wait()
    for _ in range(2):
        with folder_lock(tmp_path):
            pass
