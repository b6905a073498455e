"""Simulated Franka arms as processes: the environment of their server, and one arm's life in it."""

import os
import re
import shutil
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType

import numpy as np
from franka_model import write_fr3_mjcf
from numpy.typing import NDArray

SERVER = Path(__file__).with_name("franka_server.py")
REQUIREMENT = "franka-sim==1.1.7"
COMMAND_PORT = 1337
STARTS_WITHIN = 30.0  # [s]


def server_environment(folder: Path) -> Path:
    """Python of an environment with the simulated server, made in a folder on first use (seconds, from PyPI)."""
    python = folder / "bin" / "python"
    if not python.exists():
        uv = shutil.which("uv")
        if uv is None:
            raise RuntimeError("uv is needed to make the environment of the simulated server.")
        subprocess.run([uv, "venv", "--quiet", "--python", sys.executable, str(folder)], check=True)
        subprocess.run([uv, "pip", "install", "--quiet", "--python", str(python), REQUIREMENT], check=True)
    return python


@dataclass
class SimulatedFranka:
    """A Franka arm behind its network protocol, from ``with`` to its end.

    Attributes:
        python: Interpreter of the server's environment.
        folder: Where it writes its model and its log.
        address: One of this machine's own.
        strict: It stops for lost packets and broken limits, as a real arm does; a busy machine loses packets.
    """

    python: Path
    folder: Path
    address: str = "127.0.0.1"
    strict: bool = False
    process: "subprocess.Popen[str] | None" = field(default=None, init=False)

    def __enter__(self) -> "SimulatedFranka":
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.kill()

    @property
    def states_file(self) -> Path:
        """CSV file of the states since the start."""
        return self.folder / f"{self.address}.csv"

    def start(self) -> None:
        """Start the server and wait until it answers.

        Raises:
            RuntimeError: it does not.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        self.states_file.unlink(missing_ok=True)
        model = self.folder / "fr3.xml"
        if not model.exists():
            write_fr3_mjcf(model)
        command = [str(self.python), str(SERVER), "--model", str(model), "--address", self.address]
        said = (self.folder / f"{self.address}.log").open("w")
        environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
        self.process = subprocess.Popen(
            [*command, "--log", str(self.states_file), *(["--strict"] if self.strict else [])],
            stdin=subprocess.PIPE, stdout=said, stderr=said, text=True, env=environment,
        )  # fmt: skip
        until = time.monotonic() + STARTS_WITHIN
        while not self._answers():
            if self.process.poll() is not None or time.monotonic() > until:
                raise RuntimeError(f"The simulated arm has not started; see {said.name}.")
            time.sleep(0.1)

    def tell(self, disturbance: str) -> None:
        """Disturb the arm, as ``franka_server.py`` says."""
        assert self.process is not None and self.process.stdin is not None
        self.process.stdin.write(f"{disturbance}\n")
        self.process.stdin.flush()

    def kill(self) -> None:
        """End the server without a word to its client."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None

    def states(self) -> NDArray[np.float64]:
        """States (T, 10) since the start: time [s], mode, seven joint angles [rad], width of the hand [m]."""
        lines = self.states_file.read_text().splitlines()
        return np.array([[float(value) for value in line.split(",")] for line in lines if line.count(",") == 9])

    def pace(self) -> float:
        """The slowest that its physics ran, as a share of real time: below 1 the computer was too slow for it."""
        said = (self.folder / f"{self.address}.log").read_text()
        return min([1.0, *map(float, re.findall(r"running at ([\d.]+)x real time", said))])

    def _answers(self) -> bool:
        # The command port is open from the beginning; states are written once physics runs.
        if not self.states_file.exists() or not self.states_file.stat().st_size:
            return False
        with socket.socket() as probe:
            return probe.connect_ex((self.address, COMMAND_PORT)) == 0
