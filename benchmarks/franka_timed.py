"""A stock LeRobot command, and when its Franka follower was read and commanded:

    python benchmarks/franka_timed.py times.csv lerobot-rollout --robot.type=er_il_franka ...

writes one row a control step: when reading began and when the command was out, in seconds.
"""

import importlib
import sys
import time
from pathlib import Path
from typing import Any

from er_il.robots.hardware import FrankaFollower


def main() -> None:
    """Run the command that the arguments name."""
    times, command, *_ = sys.argv[1:]
    observe, send = FrankaFollower.get_observation, FrankaFollower.send_action
    began = time.perf_counter()
    with Path(times).open("w") as file:

        def observe_at(robot: FrankaFollower) -> Any:
            nonlocal began
            began = time.perf_counter()
            return observe(robot)

        def send_at(robot: FrankaFollower, action: Any) -> Any:
            sent = send(robot, action)
            file.write(f"{began},{time.perf_counter()}\n")
            return sent

        FrankaFollower.get_observation, FrankaFollower.send_action = observe_at, send_at
        sys.argv = sys.argv[2:]
        importlib.import_module(f"lerobot.scripts.{command.replace('-', '_')}").main()


if __name__ == "__main__":
    main()
