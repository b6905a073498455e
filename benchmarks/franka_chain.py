"""The whole way from a guided Franka to a policy that moves one, over the arms' own protocol:

    python benchmarks/franka_chain.py

It starts two simulated arms and a camera, runs LeRobot's stock commands and er_il's on them, provokes faults, and
writes results/franka/report.json and a film of the rollout. It takes about six minutes.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from franka_camera import Scene
from franka_faults import fault_table
from numpy.typing import NDArray
from simulated_franka import SimulatedFranka, server_environment

from er_il.arms.arm import Arm
from er_il.report.films import write_film
from er_il.support.provenance import provenance

HERE = Path(__file__).parent
RESULTS = HERE.parent / "results" / "franka"
FOLLOWER, LEADER = "127.0.0.1", "127.0.0.2"
PORT = 5557  # of the camera
RATE = 20  # [Hz]
SIZE = 96  # [px] of the policy's camera
SPEED = 0.5
EPISODES = 4
EPISODE_TIME, RESET_TIME = 5.0, 4.0  # [s]
REACH = np.array([0.5, 0.3, -0.4, 0.5, 0.3, 0.3, 0.4])  # [rad] the guided motion from home
CLOSED, OPEN = 0.03, 0.08  # [m] width of the hand
FILM_RATE, FILM_SIZE = 25, (480, 400)  # [Hz], [px]
TINY = ("dim_model=64", "dim_feedforward=128", "n_heads=4", "n_encoder_layers=2", "use_vae=false")
CAMERA = f"{{front: {{type: zmq, server_address: 127.0.0.1, port: {PORT}, width: {SIZE}, height: {SIZE}, fps: 30}}}}"
ROBOT = ("--robot.type=er_il_franka", f"--robot.address={FOLLOWER}", f"--robot.speed={SPEED}")
TELEOP = ("--teleop.type=er_il_franka_leader", f"--teleop.address={LEADER}")


@dataclass
class Session:
    """Commands in a folder, and what is to be reported of them."""

    folder: Path
    commands: list[dict[str, Any]] = field(default_factory=list)

    def run(self, command: Sequence[str], heard: Callable[[str], None] = lambda line: None) -> None:
        """Run a command, with what it writes to ``output.txt``; ``heard`` gets each line.

        Raises:
            RuntimeError: it fails.
        """
        print("+", shlex.join(command), flush=True)
        began = time.monotonic()
        environment = os.environ | {"PYTHONUNBUFFERED": "1"}
        process = subprocess.Popen(
            program(command), cwd=self.folder, env=environment, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        assert process.stdout is not None
        with (self.folder / "output.txt").open("a") as output:
            for line in process.stdout:
                output.write(line)
                output.flush()
                heard(line)
        self.commands.append({"command": shlex.join(command), "seconds": round(time.monotonic() - began, 1)})
        if process.wait() != 0:
            raise RuntimeError(f"{command[0]} failed; see {self.folder / 'output.txt'}.")


def program(command: Sequence[str]) -> list[str]:
    """A stock command or er-il's as this Python runs it; commands that move the follower write their times."""
    if command[0] in ("lerobot-rollout", "lerobot-record", "lerobot-teleoperate"):
        return [sys.executable, str(HERE / "franka_timed.py"), f"{command[0]}.csv", *command]
    if command[0] == "er-il":
        return [sys.executable, "-m", "er_il", *command[1:]]
    return [sys.executable, "-m", f"lerobot.scripts.{command[0].replace('-', '_')}", *command[1:]]


def motion(seconds: float, episode: int, back: bool = False) -> NDArray[np.float64]:
    """The hand's way (T, 9) from home, where an episode reaches, or back: time [s], joints [rad], width [m]."""
    times = np.linspace(0.0, seconds, 200)
    along = 0.5 - 0.5 * np.cos(np.pi * np.clip(times / (0.8 * seconds), 0.0, 1.0))
    along = 1.0 - along if back else along
    q = Arm.preset("fr3").home + np.outer(along, REACH * (1.0 + 0.1 * episode))
    width = OPEN + (CLOSED - OPEN) * np.clip(2.0 * along - 1.0, 0.0, 1.0)
    return np.column_stack([times, q, width])


class Guide:
    """A person at the leader: moves it when LeRobot announces an episode, and back between two."""

    def __init__(self, leader: SimulatedFranka) -> None:
        self._leader = leader
        self._episode = -1

    def __call__(self, line: str) -> None:
        """Listen to a line of lerobot-record."""
        if "Recording episode" in line:
            self._episode += 1
            self.lead(motion(EPISODE_TIME, self._episode))
        elif "Reset the environment" in line:
            self.lead(motion(RESET_TIME, self._episode, back=True))

    def lead(self, path: NDArray[np.float64]) -> None:
        """Lead the arm along a path (T, 9)."""
        file = self._leader.folder / "path.csv"
        np.savetxt(file, path, delimiter=",")
        self._leader.tell(f"guide {file}")


def tracking(leader: NDArray[np.float64], follower: NDArray[np.float64]) -> dict[str, float]:
    """How the follower mirrors the leader, from the states of both: its lag, and the error beyond that."""
    times = np.arange(leader[0, 0], leader[-1, 0], 0.02)
    target, measured = (
        np.column_stack([np.interp(times, states[:, 0], states[:, joint]) for joint in range(2, 9)])
        for states in (leader, follower)
    )
    errors = []
    for steps in range(40):
        errors.append(float(np.abs(measured[steps:] - target[: len(target) - steps]).max()))
    best = int(np.argmin(errors))
    return {"lag_s": round(0.02 * best, 3), "largest_error_rad": round(errors[best], 4)}


def period(file: Path) -> dict[str, float]:
    """Percentiles of the control loop [ms] from its times: the period, and the work in it, decoding included."""
    times = np.loadtxt(file, delimiter=",")
    periods, work = np.diff(times[:, 0]), times[:, 1] - times[:, 0]
    periods = periods[periods < 1.0]  # not what lies between two episodes
    return {
        "steps": len(times),
        "period_p50_ms": round(1e3 * float(np.percentile(periods, 50)), 2),
        "period_p99_ms": round(1e3 * float(np.percentile(periods, 99)), 2),
        "work_p50_ms": round(1e3 * float(np.percentile(work, 50)), 2),
        "work_p90_ms": round(1e3 * float(np.percentile(work, 90)), 2),
        "work_p99_ms": round(1e3 * float(np.percentile(work, 99)), 2),
    }


def since(states: NDArray[np.float64], start: float) -> NDArray[np.float64]:
    """The states from a time [s] on."""
    return states[states[:, 0] >= start]


def chain(session: Session, follower: SimulatedFranka, leader: SimulatedFranka, steps: int) -> dict[str, Any]:
    """Teleoperate, record, encode, train, attach and roll out; returns what was measured."""
    guide = Guide(leader)
    report: dict[str, Any] = {}

    start = time.monotonic()
    returning = motion(5.0, 0, back=True)
    returning[:, 0] += 5.0
    there_and_back = np.concatenate([motion(5.0, 0), returning])
    begun = threading.Event()

    def lead_once(line: str) -> None:
        nonlocal start
        if "Teleop loop time" in line and not begun.is_set():
            begun.set()
            start = time.monotonic()
            guide.lead(there_and_back)

    session.run(["lerobot-teleoperate", *ROBOT, *TELEOP, f"--fps={RATE}", "--teleop_time_s=11"], lead_once)
    report["teleoperate"] = tracking(since(leader.states(), start), since(follower.states(), start))
    report["teleoperate"] |= period(session.folder / "lerobot-teleoperate.csv")

    robot = (*ROBOT, f"--robot.cameras={CAMERA}")
    session.run(
        ["lerobot-record", *robot, *TELEOP, "--dataset.repo_id=me/reach", "--dataset.root=reach",
         f"--dataset.fps={RATE}", f"--dataset.num_episodes={EPISODES}", f"--dataset.episode_time_s={EPISODE_TIME:g}",
         f"--dataset.reset_time_s={RESET_TIME:g}", "--dataset.single_task=Reach.", "--dataset.push_to_hub=false",
         "--dataset.video=false", "--play_sounds=false"], guide,
    )  # fmt: skip
    report["record"] = period(session.folder / "lerobot-record.csv")
    guide.lead(motion(RESET_TIME, EPISODES - 1, back=True))
    session.run(["er-il", "encode", "reach", "--to", "erj", "--arm", "fr3", "--units", "deg", "--out", "reach_erj"])
    session.run(["er-il", "verify", "reach_erj"])
    session.run(
        ["lerobot-train", "--policy.type=act", "--policy.device=cpu", "--policy.push_to_hub=false",
         "--dataset.repo_id=me/reach_erj", "--dataset.root=reach_erj", "--dataset.video_backend=pyav",
         "--output_dir=act", f"--steps={steps}", "--batch_size=8", "--num_workers=0", "--log_freq=50",
         "--policy.pretrained_backbone_weights=null", *(f"--policy.{option}" for option in TINY),
         "--policy.chunk_size=20", "--policy.n_action_steps=10", "--policy.optimizer_lr=1e-4",
         "--policy.normalization_mapping={VISUAL: MEAN_STD, STATE: MIN_MAX, ACTION: IDENTITY}"],
    )  # fmt: skip
    session.run(["er-il", "attach", "act", "--out", "act_robot", "--fps", str(RATE)])
    # The arm has followed the leader nearly home; the rollout starts where the episodes do.
    session.run(["lerobot-teleoperate", *ROBOT, *TELEOP, f"--fps={RATE}", "--teleop_time_s=4"])
    start = time.monotonic()
    session.run(
        ["lerobot-rollout", "--policy.path=act_robot", *robot, f"--fps={RATE}", "--duration=8", "--task=Reach.",
         "--return_to_initial_position=false"],
    )  # fmt: skip
    report["rollout"] = period(session.folder / "lerobot-rollout.csv") | reached(since(follower.states(), start))
    film(since(follower.states(), start), follower.folder / "fr3.xml")
    return report


def reached(states: NDArray[np.float64]) -> dict[str, Any]:
    """Where a rollout led the arm, next to where the demonstrations lead it."""
    home = Arm.preset("fr3").home
    middle = home + REACH * (1.0 + 0.1 * (EPISODES - 1) / 2)
    speed = np.abs(np.diff(states[:, 2:9], axis=0)) / np.diff(states[:, :1], axis=0)
    return {
        "start_deg": np.degrees(states[0, 2:9]).round(1).tolist(),
        "end_deg": np.degrees(states[-1, 2:9]).round(1).tolist(),
        "demonstrated_end_deg": np.degrees(middle).round(1).tolist(),
        "largest_speed_share": round(float((np.percentile(speed, 99.5, axis=0) / Arm.preset("fr3").velocity).max()), 3),
        "hand_width_at_end_m": float(states[-1, 9]),
    }


def film(states: NDArray[np.float64], model: Path) -> None:
    """Write the film of the arm's states while it moves."""
    moving = np.abs(states[:, 2:9] - states[0, 2:9]).max(axis=1) > 0.01
    first = max(0, int(np.argmax(moving)) - FILM_RATE)
    times = np.arange(states[first, 0], states[-1, 0], 1 / FILM_RATE)
    scene = Scene(model, FILM_SIZE)
    rows = np.searchsorted(states[:, 0], times)
    write_film([scene.picture(states[row, 2:9]) for row in rows], RESULTS / "rollout.mp4", FILM_RATE)


def main() -> None:
    """Run the chain and the faults."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--environment", type=Path, default=Path(tempfile.gettempdir()) / "franka-sim")
    parser.add_argument("--steps", type=int, default=400, help="of training")
    options = parser.parse_args()
    os.environ["FRANKA_REALTIME"] = "ignore"  # the arms are simulated
    python = server_environment(options.environment)
    RESULTS.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="franka-chain-"))
    print(f"In {folder}", flush=True)
    session = Session(folder)
    follower, leader = SimulatedFranka(python, folder, FOLLOWER), SimulatedFranka(python, folder, LEADER)
    with follower, leader:
        camera = [sys.executable, str(HERE / "franka_camera.py"), str(folder / "fr3.xml"), str(follower.states_file)]
        looking = subprocess.Popen([*camera, "--port", str(PORT), "--size", str(SIZE)])
        try:
            report = chain(session, follower, leader, options.steps)
        finally:
            looking.kill()
            looking.wait()
    pace = {arm.address: arm.pace() for arm in (follower, leader)}
    whole: dict[str, Any] = {"meta": provenance() | {"slowest_physics_of_real_time": pace}}
    whole |= {"commands": session.commands, "chain": report}
    write(whole)
    whole["faults"] = fault_table(python, folder / "faults")
    write(whole)


def write(whole: dict[str, Any]) -> None:
    """Write the report."""
    (RESULTS / "report.json").write_text(json.dumps(whole, indent=2) + "\n")


if __name__ == "__main__":
    main()
