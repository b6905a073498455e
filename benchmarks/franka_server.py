"""A simulated Franka arm with hand behind Franka's network protocol, at an address of its own.

    pip install franka-sim  # in an environment of its own: it needs older NumPy and MuJoCo than er_il
    python benchmarks/franka_server.py --model fr3.xml --address 127.0.0.1

As ``run-franka-sim-server``, whose server it starts; besides, a line on its standard input disturbs it:

    lose SECONDS        lose all packets of both directions
    reflex              stop the motion by a reflex
    guide FILE          lead arm and fingers along FILE, CSV rows of seconds, seven joint angles [rad], width [m]

``--log FILE`` writes 100 times a second: the system's monotonic time [s], the robot's mode, seven measured joint angles
[rad], the hand's width [m]. ``--strict`` has the box stop a motion for lost packets and broken limits, as a real one.
"""

import argparse
import csv
import sys
import threading
import time
from pathlib import Path

import numpy as np
from franka_sim import mujoco_franka_sim
from franka_sim.franka_sim_server import FrankaSimServer

HOME = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)  # [rad]
LOG_PERIOD = 0.01  # [s]
GUIDE_PERIOD = 0.002  # [s]
BLEND = 1.0  # [s] of leading the arm onto a path
REFLEX = 6  # index of joint_reflex among the protocol's errors: an external torque above its threshold


class LossySocket:
    """A UDP socket that can lose what it sends and receives."""

    def __init__(self, inner):
        self._inner = inner
        self.loses_until = 0.0  # [s] of the monotonic clock

    def __getattr__(self, name):
        return getattr(self._inner, name)

    def recvfrom(self, size):
        received = self._inner.recvfrom(size)
        if time.monotonic() < self.loses_until:
            raise BlockingIOError
        return received

    def sendto(self, data, address):
        return len(data) if time.monotonic() < self.loses_until else self._inner.sendto(data, address)


class Server(FrankaSimServer):
    """The simulated control box; disturbances act on its sockets, its motion and its arm."""

    @property
    def udp_socket(self):
        return self._udp_socket

    @udp_socket.setter
    def udp_socket(self, inner):
        self._udp_socket = inner if inner is None else LossySocket(inner)

    def lose(self, seconds):
        if self._udp_socket is not None:
            self._udp_socket.loses_until = time.monotonic() + seconds

    def reflex(self):
        self._abort_with_error(REFLEX, "provoked from the standard input", self._motion_generation)

    def guide(self, path):
        """Lead the held arm along a path, as a hand does that overcomes its weight."""
        rows = np.loadtxt(path, delimiter=",", ndmin=2)
        here, start = self.physics_sim.get_robot_state()["q"], time.monotonic()
        while (passed := time.monotonic() - start) <= rows[-1, 0]:
            q = np.array([np.interp(passed, rows[:, 0], rows[:, joint]) for joint in range(1, 8)])
            blend = min(1.0, passed / BLEND)  # from where the arm is
            self.physics_sim.update_joint_positions((1.0 - blend) * here + blend * q)
            self.gripper_server.backend.move(float(np.interp(passed, rows[:, 0], rows[:, 8])), speed=0.1)
            time.sleep(GUIDE_PERIOD)

    def obey(self, lines):
        """Carry out disturbances, one a line."""
        for line in lines:
            name, *values = line.split()
            if name == "lose":
                self.lose(float(values[0]))
            elif name == "reflex":
                self.reflex()
            elif name == "guide":
                threading.Thread(target=self.guide, args=values, daemon=True).start()

    def log(self, path):
        """Write the arm's state for ever, once there is one."""
        while not self.physics_sim.running:
            time.sleep(LOG_PERIOD)
        with Path(path).open("w", newline="") as file:
            writer = csv.writer(file)
            while True:
                mode = self.robot_state.state["robot_mode"]
                width = self.gripper_server.backend.get_state().width
                q = self.physics_sim.get_robot_state()["q"]
                writer.writerow(
                    [f"{time.monotonic():.4f}", int(mode), *(f"{angle:.6f}" for angle in q), f"{width:.4f}"]
                )
                file.flush()
                time.sleep(LOG_PERIOD)


def main():
    """Serve one arm until interrupted."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", required=True, help="MJCF of the arm")
    parser.add_argument("--address", default="127.0.0.1")
    parser.add_argument("--start", type=float, nargs=7, default=HOME, help="joint angles to start at [rad]")
    parser.add_argument("--log", help="CSV file for the arm's states")
    parser.add_argument("--strict", action="store_true", help="stop as a real arm for lost packets and broken limits")
    options = parser.parse_args()

    mujoco_franka_sim.ARM_INITIAL_Q = np.array(options.start)
    server = Server(
        host=options.address,
        physics_sim=mujoco_franka_sim.MujocoFrankaSim(model_path=options.model),
        enforce_comm_constraints=options.strict,
        enforce_motion_limits=options.strict,
    )
    threading.Thread(target=server.obey, args=(sys.stdin,), daemon=True).start()
    if options.log:
        threading.Thread(target=server.log, args=(options.log,), daemon=True).start()
    try:
        server.start()
    except KeyboardInterrupt:
        pass
    finally:
        server.stop()


if __name__ == "__main__":
    main()
