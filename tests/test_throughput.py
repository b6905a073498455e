"""The measurements of speed and memory: what is counted, and of how much."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import throughput
import usage

from er_il.datasets.dataset import Dataset

BUSY = "import time; memory = bytearray(100_000_000)\nwhile time.process_time() < 0.3: pass"
# Ends before the process that it starts, as the parent of LeRobot's fork server does.
HEADSTRONG = f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {BUSY!r}])"


def test_what_survives_a_command_is_counted_and_waited_for(tmp_path: Path) -> None:
    command = [sys.executable, usage.__file__, tmp_path / "log.txt", sys.executable, "-c", HEADSTRONG]
    used = json.loads(subprocess.check_output(command))
    assert used["cpu_s"] > 0.3 and used["wall_s"] > 0.3
    assert 100 < used["peak_memory_mb"] < 200  # of the largest process, not of this one, which has loaded LeRobot


def test_a_dataset_is_repeated_until_it_has_enough_frames(tmp_path: Path) -> None:
    source = Dataset(Path(__file__).parent / "golden/push_button_elbow/erj")
    throughput.enlarge(source.root, tmp_path / "large", 4 * source.frames + 1)
    large = Dataset(tmp_path / "large")
    assert large.frames == 6 * source.frames  # two rounds of three and two
    assert list(large.episodes) == list(range(6 * len(source.episodes)))
    np.testing.assert_array_equal(large.vectors("action"), np.tile(source.vectors("action"), (6, 1)))
    assert large.spec == source.spec


def test_every_space_is_stepped_along_the_same_demonstrations() -> None:
    rows = throughput.step_rates(1)
    assert [row["space"] for row in rows] == list(throughput.SPACES)
    assert rows[0]["relative_to_joint"] == 1.0
    assert len({row["steps"] for row in rows}) == 1
