"""A Franka arm through its control interface (FCI), by ``franka-rs``.

The 1 kHz loop runs inside that library, on a thread of its own that does not wait for Python: it moves the arm to the
latest target under limits of velocity, acceleration and jerk, as a spring and a damper in joint space, and holds it
there.
"""

import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from er_il.arms.arm import Vector
from er_il.robots.hardware.franka_library import in_words, library
from er_il.support.errors import RobotError

logger = logging.getLogger(__name__)

FCI_VERSIONS = {"fr3": 10, "panda": 5}  # arm -> version of its protocol
# Of the spring and the damper in the joints [Nms/rad, Nm/rad]. The damping is that of Franka's example of joint
# impedance; the stiffness is in proportion to it, so that all joints lag equally and the arm keeps its path.
DAMPING = (50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0)
LAG = 1 / 12  # [s]
STIFFNESS = tuple(damping / LAG for damping in DAMPING)
ACCELERATION = 7.5  # [rad/s²] the lowest limit of a joint of both arms
WHOLE_RANGE = 2 * np.pi  # [rad] the loop's own limit on the way from its start: none that a joint could reach

# Mode in which the arm takes no motion -> what to do about it.
BLOCKING_MODES = {
    "other": "Unlock its joints and activate FCI in Desk.",
    "guiding": "It is being guided by hand: let go of its buttons.",
    "user_stopped": "Its stop button is pressed, or it is in programming mode: release it, or change to execution.",
    "move": "Another program moves it: end that program.",
}


class FrankaArm:
    """One arm, connected on construction: read, and moved between :meth:`start` and :meth:`close`."""

    def __init__(self, address: str) -> None:
        """Connect to the control box at an address.

        Raises:
            RobotError: the library is missing, or nothing answers there.
        """
        self.address = address
        self._library = library()
        self._targets: Any = None
        self._speed = 1.0
        # The library raises the thread that connects to real-time priority, if it may: not ours, which also computes.
        with ThreadPoolExecutor(max_workers=1) as connecting:
            self._robot: Any = self._told(connecting.submit(self._library.Robot, address).result)

    def check_kind(self, arm: str) -> None:
        """Check that it is an arm of that name.

        Raises:
            RobotError: it is another kind, whose limits differ.
        """
        version = self._robot.fci_version
        if version != FCI_VERSIONS[arm]:
            kinds = [name for name, each in FCI_VERSIONS.items() if each == version]
            raise RobotError(
                f"The arm at {self.address} is no {arm}: it speaks version {version} of the protocol"
                + (f", as does {kinds[0]}." if kinds else ".")
            )

    def measure(self) -> Vector:
        """Joint angles (7,) [rad].

        Raises:
            RobotError: the connection is lost.
        """
        return np.asarray(self._state().q, dtype=np.float64)

    def rest(self) -> Vector:
        """Joint angles (7,) [rad] at which the arm comes to rest if it brakes now.

        Raises:
            RobotError: the connection is lost.
        """
        state = self._state()
        q, dq = np.asarray(state.q, dtype=np.float64), np.asarray(state.dq, dtype=np.float64)
        return q + LAG * dq + dq * np.abs(dq) / (2.0 * self._speed * ACCELERATION)

    def start(self, speed: float, torque: float, force: float) -> None:
        """Recover the arm if a reflex has stopped it, and take over its motion; it holds where it is.

        Args:
            speed: Share of the joints' limits of velocity, acceleration and jerk, in (0, 1].
            torque: External torque at a joint [Nm] that stops the arm by a reflex.
            force: External force [N] and moment [Nm] at the end effector that do.

        Raises:
            RobotError: the arm is not ready.
        """
        mode = self._told(self._robot.read_once).robot_mode
        if mode == "reflex":
            self._told(self._robot.automatic_error_recovery)
            logger.warning("The arm at %s had stopped by a reflex; it is recovered.", self.address)
        elif mode in BLOCKING_MODES:
            raise RobotError(f"The arm at {self.address} is not ready. {BLOCKING_MODES[mode]}")
        torques, forces = [torque] * 7, [force] * 6
        self._speed = speed
        self._told(lambda: self._robot.set_collision_behavior_simple(torques, torques, forces, forces))
        self._targets = self._told(
            lambda: self._robot.joint_targets(
                fraction=speed, max_deviation=WHOLE_RANGE, joint_stiffness=STIFFNESS, joint_damping=DAMPING
            )
        )

    @property
    def moving(self) -> bool:
        """True from :meth:`start` until the motion ends, for whatever reason."""
        return self._targets is not None and self._targets.running

    def aim(self, q: Vector) -> None:
        """Move towards joint angles (7,) [rad], at least 0.05 rad within the joint limits; returns at once.

        Raises:
            RobotError: the motion has ended; :meth:`end` says why.
        """
        self._told(lambda: self._targets.move_to(q))

    def end(self) -> RobotError | None:
        """End the motion, arrived at the last target; what had ended it before, if anything has."""
        targets, self._targets = self._targets, None
        if targets is None:
            return None
        try:
            self._told(targets.stop)
        except RobotError as error:
            return error
        return None

    def hand(self) -> Any:
        """Connect to the arm's hand.

        Raises:
            RobotError: it has none, or none is configured in Desk.
        """
        try:
            return self._told(self._robot.gripper)
        except RobotError as error:
            raise RobotError(f"{error} If the arm has no hand, set gripper to false.") from error

    def close(self) -> None:
        """End the motion and the connection; the arm holds."""
        self.end()
        self._robot = None

    def _state(self) -> Any:
        return self._told(self._robot.read_once if self._targets is None else self._targets.state)

    def _told(self, ask: Callable[[], Any]) -> Any:
        """Ask the library, and put its errors in words."""
        return in_words(self.address, ask)
