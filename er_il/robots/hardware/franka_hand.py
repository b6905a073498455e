"""The Franka Hand as a gripper with an opening that is asked for, and measured, without waiting for its motion."""

import math
import threading
from typing import Any

from er_il.robots.hardware.franka_arm import FrankaArm
from er_il.robots.hardware.franka_library import in_words
from er_il.support.errors import RobotError

SPEED = 0.1  # [m/s] of the fingers
STEP = 0.02  # of the opening: a smaller change is not worth a command
BLOCKED = 0.05  # of the opening: fingers this far from where they were told to close to have met something


class FrankaHand:
    """A hand whose commands, which wait for the fingers, and measurements run on threads of their own.

    It homes once after power-on, which moves its fingers. Closing fingers that meet something grasp it by ``force``.
    """

    def __init__(self, arm: FrankaArm, force: float) -> None:
        """Connect to the hand of an arm, to grasp by a force [N].

        Raises:
            RobotError: there is no hand.
        """
        self._address = arm.address
        self._force = force
        self._hand: Any = arm.hand()
        self._failure: RobotError | None = None
        if self._ask(self._hand.read_once).max_width <= 0:
            self._ask(self._hand.homing)
        state = self._ask(self._hand.read_once)
        self._width: float = state.max_width  # [m]
        self._measured = self._told = self._wanted = state.width / self._width
        self._news = threading.Event()
        self._closed = False
        self._threads = [
            threading.Thread(target=self._run, args=(step,), daemon=True) for step in (self._read, self._move)
        ]
        for thread in self._threads:
            thread.start()

    def opening(self) -> float:
        """The measured opening in [0, 1], 1 open.

        Raises:
            RobotError: the hand has failed.
        """
        if self._failure is not None:
            raise self._failure
        return self._measured

    def aim(self, opening: float) -> float:
        """Move the fingers to an opening in [0, 1]; returns at once, with the opening that counts from now on.

        It is the latest; one that is not finite leaves the last standing.
        """
        if math.isfinite(opening):
            self._wanted = min(max(opening, 0.0), 1.0)
            self._news.set()
        return self._wanted

    def close(self) -> None:
        """End the connection; the fingers stay, and hold what they have grasped."""
        self._closed = True
        self._news.set()
        for thread in self._threads:
            thread.join()

    def _ask(self, ask: Any) -> Any:
        return in_words(self._address, ask)

    def _run(self, step: Any) -> None:
        try:
            while not self._closed:
                step()
        except RobotError as error:
            self._failure = error

    def _read(self) -> None:
        self._measured = self._ask(self._hand.read_once).width / self._width  # waits for the hand's next state

    def _move(self) -> None:
        self._news.wait()
        self._news.clear()
        wanted = self._wanted
        if self._closed or abs(wanted - self._told) < STEP:
            return
        closing, self._told = wanted < self._told, wanted
        self._ask(lambda: self._hand.move(wanted * self._width, SPEED))
        if closing and self._ask(self._hand.read_once).width / self._width > wanted + BLOCKED:
            whole = self._width  # whatever the size of what lies between the fingers
            self._ask(lambda: self._hand.grasp(wanted * whole, SPEED, self._force, whole, whole))
