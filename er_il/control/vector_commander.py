"""From what a policy says to what a robot may do: a layout's arms, each with its commander."""

import logging
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.control.commander import BEST_EFFORT, Command, Commander
from er_il.kinematics.solver import Status
from er_il.spaces import JointSpace
from er_il.spaces.layout import Layout
from er_il.support.errors import ErIlError, ShapeError

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class RobotCommand:
    """What a robot is told in one control period."""

    vector: Vector  # (D,) the robot's values, in its units; finite
    arms: tuple[Command, ...]


class RobotCommander:
    """Decodes encoded vectors to joint vectors that the robot can follow, and logs what was invalid.

    Each arm is limited as :class:`er_il.control.commander.Commander` says. Once one arm stops, all do. What
    belongs to no arm (grippers, say) goes through as it is, as long as every arm follows.

    Episodes begin with :meth:`reset`. LeRobot's recording never resets its processors, and a person
    may take over in between: an arm that is elsewhere than commanded goes on from where it is. So a
    command is within one period's way of the last one, or else of the measured joints.
    """

    def __init__(self, layout: Layout, period: float, on_invalid: str = BEST_EFFORT) -> None:
        """Prepare for a control period [s]; see :class:`er_il.control.commander.Commander` for ``on_invalid``.

        Raises:
            UnknownNameError: ``on_invalid`` is no valid answer.
        """
        self.layout = layout
        self._on_invalid = on_invalid
        self._commanders = [Commander(part.space, period, on_invalid) for part in layout.parts]
        self._passed: Vector | None = None
        self._started = self._strayed = False
        self._invalid = False  # the last action was
        self._outcomes: Counter[str] = Counter()  # of actions

    def reset(self) -> None:
        """Forget the episode: the next command starts from the measured joints."""
        if self._outcomes:
            outcomes = "; ".join(f"{count} {outcome}" for outcome, count in self._outcomes.most_common())
            logger.info("Actions decoded: %s", outcomes)
        self._started = self._strayed = self._invalid = False
        self._passed = None
        self._outcomes.clear()

    def anchor(self, measured: ArrayLike) -> None:
        """Go on from the measured values (D,), wherever the last command was."""
        for commander, part in zip(self._commanders, self.layout.parts, strict=True):
            commander.anchor(self.layout.angles(part, measured))

    def command(self, action: ArrayLike, measured: ArrayLike) -> RobotCommand:
        """Turn an encoded vector into the next joint vector.

        Args:
            action: (len(layout.encoded_names),) as the policy gives it.
            measured: (D,) the robot's values; NaN for dimensions of no arm that are not measured.

        Raises:
            ShapeError: a vector has another length.
            ErIlError: the first measurement of a joint is not finite, or nothing finite was ever
                said or measured of another dimension.
        """
        own, passed = self._split(action)
        now = np.asarray(measured, dtype=np.float64)
        if now.shape != (len(self.layout.names),):
            raise ShapeError("Measured values", now.shape, f"({len(self.layout.names)},)")
        angles = [self.layout.angles(part, now) for part in self.layout.parts]
        strayed = False
        for commander, q in zip(self._commanders, angles, strict=True):
            if not self._started:
                commander.reset(q)
            elif commander.strayed(q):
                commander.anchor(q)
                strayed = True
        if strayed and not self._strayed:
            logger.warning("The arm was moved by something else; its commands go on from where it is.")
        self._started, self._strayed = True, strayed
        arms = tuple(c.command(each, q) for c, each, q in zip(self._commanders, own, angles, strict=True))
        if any(arm.stopped for arm in arms):
            for commander in self._commanders:
                commander.stop()
        self._log(arms)
        return RobotCommand(self._joined(arms, passed, now), arms)

    def _split(self, action: ArrayLike) -> tuple[list[Vector], Vector]:
        """Each arm's own action, with a gripper that means nothing, and what belongs to no arm."""
        layout, command = self.layout, np.asarray(action, dtype=np.float64)
        if command.shape != (len(layout.encoded_names),):
            names = ", ".join(layout.encoded_names)
            raise ShapeError("The policy's action", command.shape, f"({len(layout.encoded_names)},): {names}")
        passed = command[[layout.encoded_names.index(name) for name in layout.passed]]
        if layout.kind == JointSpace.kind:
            own = [layout.angles(part, command) for part in layout.parts]
        else:
            own = np.split(command, np.cumsum([len(part.names) for part in layout.parts]))[:-1]
        return [np.append(each, 1.0) for each in own], passed

    def _joined(self, arms: tuple[Command, ...], passed: Vector, measured: Vector) -> Vector:
        """The robot's values of the arms' commands and of what belongs to no arm."""
        layout = self.layout
        rest = [layout.names.index(name) for name in layout.passed]
        if self._passed is None:
            self._passed = measured[rest]
        if all(arm.followed for arm in arms):
            self._passed = np.where(np.isfinite(passed), passed, self._passed)
        if not np.all(np.isfinite(self._passed)):
            unknown = [name for name, value in zip(layout.passed, self._passed, strict=True) if not np.isfinite(value)]
            raise ErIlError(f"Nothing is known of {', '.join(unknown)}: the action is not finite, nor is it measured.")
        vector = np.empty(len(layout.names))
        vector[rest] = self._passed
        for part, arm in zip(layout.parts, arms, strict=True):
            vector[layout.indices(part)] = part.motors.values(arm.q)
        return vector

    def _log(self, arms: tuple[Command, ...]) -> None:
        invalid = [
            f"{part.label or part.space.arm.name} {arm.status}"
            for part, arm in zip(self.layout.parts, arms, strict=True)
            if arm.status is not Status.OK
        ]
        self._outcomes[", ".join(invalid) or "valid"] += 1
        if invalid and not self._invalid:  # the first of a row: one a period would hide all else
            logger.warning("Invalid action (%s); the answer is %s.", ", ".join(invalid), self._on_invalid)
        self._invalid = bool(invalid)
