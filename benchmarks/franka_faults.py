"""Faults while a simulated Franka moves, and what the arm and the command did; see ``franka_chain.py``.

Their server is strict here: like a real control box it stops a motion after 20 lost packets, or for a broken limit.
"""

import logging
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from simulated_franka import SimulatedFranka

from er_il.arms.arm import Arm
from er_il.robots.hardware import FrankaFollower, FrankaFollowerConfig
from er_il.robots.hardware.franka_follower import MARGIN
from er_il.support.errors import ErIlError

FOLLOWER, LEADER = "127.0.0.3", "127.0.0.4"
SPEED = 0.5
PERIOD = 0.05  # [s]
SWING, SWING_TIME = 0.4, 4.0  # [rad], [s] of the guided motion
STARTS_WITHIN, ENDS_WITHIN = 60.0, 6.0  # [s]
WATCHED = 2.5  # [s] after a fault
MOVING, STILL = 0.1, 0.02  # [rad/s]
TELEOPERATE = (
    "--robot.type=er_il_franka", f"--robot.address={FOLLOWER}", f"--robot.speed={SPEED}",
    "--teleop.type=er_il_franka_leader", f"--teleop.address={LEADER}", "--fps=20", "--teleop_time_s=60",
)  # fmt: skip


@dataclass
class Arms:
    """The two arms and the running lerobot-teleoperate, for a fault to disturb."""

    follower: SimulatedFranka
    leader: SimulatedFranka
    command: "subprocess.Popen[str]"


def pulled(arms: Arms) -> None:
    """Pull the follower's cable."""
    arms.follower.tell("lose 1000")


def paused(arms: Arms) -> None:
    """Stop the whole process for a second."""
    arms.command.send_signal(signal.SIGSTOP)
    time.sleep(1.0)
    arms.command.send_signal(signal.SIGCONT)


COMMAND_FAULTS: dict[str, Callable[[Arms], None]] = {
    "10 ms of packets lost": lambda arms: arms.follower.tell("lose 0.01"),
    "300 ms of packets lost": lambda arms: arms.follower.tell("lose 0.3"),
    "cable pulled": pulled,
    "reflex": lambda arms: arms.follower.tell("reflex"),
    "Ctrl-C": lambda arms: arms.command.send_signal(signal.SIGINT),
    "command killed": lambda arms: arms.command.kill(),
    "command paused for 1 s": paused,
    "leader's control box killed": lambda arms: arms.leader.kill(),
    "follower's control box killed": lambda arms: arms.follower.kill(),
}


def speeds(states: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joint speeds (T - 4, 7) [rad/s] at states, over 40 ms each."""
    return np.abs((states[4:, 2:9] - states[:-4, 2:9]) / (states[4:, :1] - states[:-4, :1]))


def aftermath(states: NDArray[np.float64], at: float) -> dict[str, Any]:
    """What the arm did after a fault at a time [s]."""
    before, after = states[states[:, 0] < at], states[states[:, 0] >= at]
    row: dict[str, Any] = {"speed_at_fault_rad_s": round(float(speeds(before[-10:]).max()), 3)}
    if len(after) < 50:
        return row | {"arm": "gone with its control box; a real one brakes by itself"}
    moving = np.flatnonzero(speeds(after).max(axis=1) > STILL)
    still = after[moving[-1], 0] - at if len(moving) else 0.0
    if still > WATCHED - 0.5:
        return row | {"arm": "goes on"}
    way = np.abs(after[:, 2:9] - before[-1, 2:9]).max()
    return row | {"arm": "holds", "way_deg": round(float(np.degrees(way)), 2), "still_after_s": round(float(still), 2)}


def command_fault(name: str, follower: SimulatedFranka, leader: SimulatedFranka) -> dict[str, Any]:
    """Let lerobot-teleoperate mirror a swinging leader, and disturb it."""
    times = np.linspace(0.0, 100.0, 4000)
    swing = SWING * np.sin(2 * np.pi * times / SWING_TIME)
    path = leader.folder / "swing.csv"
    q = Arm.preset("fr3").home + np.outer(swing, [1.0, 0.5, -0.5, 0.5, 0.5, 0.5, 1.0])
    np.savetxt(path, np.column_stack([times, q, np.full(len(times), 0.08)]), delimiter=",")
    log = follower.folder / "command.log"
    with log.open("w") as output:
        command = subprocess.Popen(
            [sys.executable, "-m", "lerobot.scripts.lerobot_teleoperate", *TELEOPERATE],
            stdout=output, stderr=output, text=True,
        )  # fmt: skip
        until = time.monotonic() + STARTS_WITHIN
        while "Teleop loop time" not in log.read_text() and command.poll() is None and time.monotonic() < until:
            time.sleep(0.1)
        leader.tell(f"guide {path}")
        time.sleep(2.0)
        while speeds(follower.states()[-10:]).max() < MOVING:
            time.sleep(0.02)
        at = time.monotonic()
        COMMAND_FAULTS[name](Arms(follower, leader, command))
        time.sleep(WATCHED)
        row = {"fault": name, **aftermath(follower.states(), at)}
        try:
            row["exit_code"] = command.wait(ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            command.send_signal(signal.SIGINT)
            command.wait()
            row["exit_code"] = "runs on"
    said = log.read_text()
    row["said"] = [line[line.index("error: ") :] for line in said.splitlines() if "error: " in line]
    row["traceback"] = "Traceback" in said
    return row


def drive(robot: FrankaFollower, q: NDArray[np.float64], steps: int) -> None:
    """Send one action (7,) [rad] again and again."""
    action = dict(zip(robot.action_features, [*np.degrees(q).tolist(), 1.0], strict=True))
    for _ in range(steps):
        robot.send_action(action)
        time.sleep(PERIOD)


def action_faults(follower: SimulatedFranka) -> list[dict[str, Any]]:
    """Actions that no policy should send, or that do not come."""
    arm = Arm.preset("fr3")
    home, rows = arm.home, []
    turn = np.eye(7)[0]  # [rad] of the first joint
    robot = FrankaFollower(FrankaFollowerConfig(address=follower.address, speed=SPEED))
    robot.connect()
    for name, sent in {
        "no action any more": None,
        "actions of NaN": np.full(7, np.nan),
        "one jump by 2 rad, then nothing": home + 3 * turn,
    }.items():
        drive(robot, home, 80)
        drive(robot, home + turn, 14)
        at = time.monotonic()
        if sent is not None:
            drive(robot, sent, 1 if "jump" in name else 40)
        time.sleep(WATCHED)
        rows.append({"fault": name, **aftermath(follower.states(), at)})
    beyond = arm.upper + 1.0
    at = time.monotonic()
    drive(robot, beyond, 120)
    states = follower.states()
    moved = states[states[:, 0] >= at]
    gaps = arm.upper - moved[:, 2:9].max(axis=0)
    rows.append(
        {
            "fault": "actions 1 rad beyond all upper limits",
            "arm": "stops before its limits",
            "least_distance_to_limit_rad": round(float(gaps.min()), 4),
            "margin_rad": MARGIN,
            "largest_speed_share": round(float((speeds(moved) / arm.velocity).max()), 3),
            "speed": SPEED,
        }
    )
    drive(robot, home, 120)
    logging.getLogger().setLevel(logging.INFO)
    logging.info("Reset the environment")  # as lerobot-record says between two episodes
    follower.tell("reflex")
    time.sleep(0.3)
    drive(robot, home, 20)
    rows.append({"fault": "reflex between two episodes", "arm": "is recovered, and goes on"})
    try:
        robot.send_action({"pos_x": 0.3})
    except ErIlError as error:
        rows.append({"fault": "an ERJ action that nothing decoded", "arm": "holds", "said": [str(error)]})
    robot.disconnect()
    return rows


def fault_table(python: Path, folder: Path) -> list[dict[str, Any]]:
    """Provoke all faults; one row each."""
    rows = []
    with SimulatedFranka(python, folder, FOLLOWER, strict=True) as follower:
        rows += action_faults(follower)
        with SimulatedFranka(python, folder, LEADER, strict=True) as leader:
            for name in COMMAND_FAULTS:
                for arm in (follower, leader):
                    if arm.process is None or "cable" in str(rows[-1]["fault"]):
                        arm.kill()
                        arm.start()
                rows.append(command_fault(name, follower, leader))
                print(rows[-1], flush=True)
    return rows
