"""What work costs."""

import subprocess
import sys
import time

from er_il.support.cost import measured

BUSY = "import time\nwhile time.process_time() < 0.5: pass"


def test_the_processes_that_work_started_are_counted_and_waiting_costs_nothing() -> None:
    with measured() as busy:
        subprocess.run([sys.executable, "-c", BUSY], check=True)
    with measured() as idle:
        time.sleep(0.2)
    assert busy.cpu > 0.4 and idle.cpu < 0.1
    assert idle.wall >= 0.2
