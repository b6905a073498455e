"""The commander of a robot that LeRobot drives: it finds by itself where an episode starts or somebody interferes."""

import logging
from collections import Counter

from numpy.typing import ArrayLike

from er_il.control.commander import BEST_EFFORT, Command
from er_il.control.vector_commander import VectorCommand, VectorCommander
from er_il.kinematics.solver import Status
from er_il.spaces.layout import Layout

logger = logging.getLogger(__name__)


class RobotCommander:
    """Decodes encoded vectors to joint vectors that the robot can follow, and logs what was invalid.

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
        self._commander = VectorCommander(layout, period, on_invalid)
        self._started = self._strayed = False
        self._invalid = False  # the last action was
        self._outcomes: Counter[str] = Counter()  # of actions

    def reset(self) -> None:
        """Forget the episode: the next command starts from the measured joints."""
        if self._outcomes:
            outcomes = "; ".join(f"{count} {outcome}" for outcome, count in self._outcomes.most_common())
            logger.info("Actions decoded: %s", outcomes)
        self._started = self._strayed = self._invalid = False
        self._outcomes.clear()

    def anchor(self, measured: ArrayLike) -> None:
        """Go on from the measured values (D,), wherever the last command was."""
        self._commander.anchor(measured)

    def command(self, action: ArrayLike, measured: ArrayLike) -> VectorCommand:
        """Turn an encoded vector into the next joint vector.

        Args:
            action: (len(layout.encoded_names),) as the policy gives it.
            measured: (D,) the robot's values; NaN for dimensions of no arm that are not measured.

        Raises:
            ShapeError: a vector has another length.
            ErIlError: the first measurement of a joint is not finite, or nothing finite was ever
                commanded or measured of another dimension.
        """
        if not self._started:
            self._commander.reset(measured)
            self._started = True
        else:
            self._follow(measured)
        command = self._commander.command(action, measured)
        self._log(command.arms)
        return command

    def _follow(self, measured: ArrayLike) -> None:
        """Let the commands of arms that something else moved go on from where they are."""
        angles, _ = self._commander.split_measured(measured)
        strayed = [arm.strayed(q) for arm, q in zip(self._commander.arms, angles, strict=True)]
        for arm, q, moved in zip(self._commander.arms, angles, strayed, strict=True):
            if moved:
                arm.anchor(q)
        if any(strayed) and not self._strayed:
            logger.warning("The arm was moved by something else; its commands go on from where it is.")
        self._strayed = any(strayed)

    def _log(self, arms: tuple[Command, ...]) -> None:
        invalid = [
            f"{part.label or part.space.arm.name} {arm.status}"
            for part, arm in zip(self.layout.parts, arms, strict=True)
            if arm.status is not Status.OK
        ]
        self._outcomes[", ".join(invalid) or "valid"] += 1
        if invalid and not self._invalid:  # the first of a row: one a period would hide all else
            answer = self._commander.on_invalid
            logger.warning("Invalid action (%s); the answer is %s.", ", ".join(invalid), answer)
        self._invalid = bool(invalid)
