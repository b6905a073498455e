"""The commander of one arm: actions decoded, checked, and limited to what the arm can do in a control period."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.kinematics.solver import IkResult, Status
from er_il.spaces.base import ArmSpace
from er_il.support.errors import ErIlError, ShapeError, UnknownNameError

BEST_EFFORT, HOLD, STOP = "best_effort", "hold", "stop"
ON_INVALID = (BEST_EFFORT, HOLD, STOP)

LEAD_PERIODS = 4  # an arm that is held up is told no further than it gets in these periods; servos need two or so
JUMP_PERIODS = 5  # a solution this many periods away at full speed is on another branch, not on the way


def check_answer(on_invalid: str) -> None:
    """Raise an :class:`UnknownNameError` unless a name is that of an answer to invalid actions."""
    if on_invalid not in ON_INVALID:
        raise UnknownNameError("answer to invalid actions", on_invalid, ON_INVALID)


@dataclass(frozen=True)
class Command:
    """The joint command of one control period."""

    q: Vector  # (n,) [rad] finite, within the joint limits and the velocity limit
    status: Status  # of the action it came from
    latency: float  # [s] time the decoding took
    iters: int  # iterations of IK that it took
    joint_step: float  # [rad] largest joint change that was asked for, before the velocity limit
    followed: bool  # the arm moves as the action says, or as nearly as it can; else the last command stands
    stopped: bool = False  # the arm holds until the next reset


@dataclass(frozen=True)
class DecodedAhead:
    """A command's action, decoded before together with those of other arms."""

    result: IkResult
    seconds: float  # its share of the time


@dataclass
class Tally:
    """Counts since the last reset."""

    statuses: Counter[Status] = field(default_factory=Counter)
    latencies: list[float] = field(default_factory=list)  # [s] one a command
    largest_step: float = 0.0  # [rad]

    @classmethod
    def sum(cls, tallies: Sequence["Tally"]) -> "Tally":
        """The counts of several arms that were commanded together: a step takes as long as all of them."""
        statuses = sum((tally.statuses for tally in tallies), Counter[Status]())
        latencies = [sum(each, 0.0) for each in zip(*(tally.latencies for tally in tallies), strict=True)]
        return cls(statuses, latencies, max(tally.largest_step for tally in tallies))

    @property
    def invalid(self) -> int:
        """Number of actions whose status was not OK."""
        return self.statuses.total() - self.statuses[Status.OK]


class Commander:
    """Decodes the actions of one arm, checks them, and limits them to what it can do in a control period.

    An action that is not OK is answered as declared by ``on_invalid``:

    - ``best_effort``: go as near to it as limits and IK allow, at no more than full speed, and of an
      elbow far away towards it only as far as the pose is kept (:meth:`ArmSpace.ease`); an action
      that means nothing (``Status.INVALID``) leaves the last command standing.
    - ``hold``: the last command stands.
    - ``stop``: the last command stands until the next reset.

    An action that determines less than all joints, next to a singularity, moves the others as little as it can
    (:meth:`ArmSpace.steady`).

    An arm that is held up, by what it ran into, is waited for: the last command stands until the arm
    has come near it, or the action leads back.
    """

    def __init__(self, space: ArmSpace, period: float, on_invalid: str = BEST_EFFORT) -> None:
        """Prepare a commander; :meth:`reset` starts it.

        Args:
            space: The action space that decodes.
            period: Control period [s].
            on_invalid: One of ``ON_INVALID``.

        Raises:
            UnknownNameError: ``on_invalid`` is none of these.
        """
        check_answer(on_invalid)
        if not period > 0:
            raise ErIlError(f"The control period is {period} s; it must be positive.")
        self.space = space
        self.on_invalid = on_invalid
        self.tally = Tally()
        self._reach = space.arm.velocity * period  # (n,) [rad] a period's way at full speed
        self._last: Vector | None = None
        self._stopped = False

    def reset(self, q: ArrayLike) -> None:
        """Start an episode from the measured joint angles q (n,) [rad]."""
        self.anchor(q)
        self._stopped = False
        self.tally = Tally()

    def anchor(self, q: ArrayLike) -> None:
        """Go on from joint angles q (n,) [rad], wherever the last command was: something else moved the arm."""
        arm = self.space.arm
        start = np.array(q, dtype=np.float64)
        if start.shape != (arm.dof,):
            raise ShapeError("Joint angles", start.shape, f"({arm.dof},)")
        if not np.all(np.isfinite(start)):
            raise ErIlError("The measured joint angles are not finite; no safe command can start from them.")
        self._last = arm.within_limits(start)

    def stop(self) -> None:
        """Let the last command stand until the next reset."""
        self._stopped = True

    def strayed(self, q: ArrayLike) -> bool:
        """True if the arm is elsewhere than any command of these periods could have left it.

        A person moved it, or another program: the velocity limit must then count from where it is.
        """
        return self._far(self.last, np.asarray(q, dtype=np.float64))

    @property
    def last(self) -> Vector:
        """The last command (n,) [rad], which a delta counts from.

        Raises:
            RuntimeError: there is none before :meth:`reset`.
        """
        if self._last is None:
            raise RuntimeError("Commander.reset must be called before the first command.")
        return self._last

    def command(self, action: ArrayLike, q: ArrayLike, ahead: DecodedAhead | None = None) -> Command:
        """Turn an action into the next command.

        Args:
            action: (dim,) as a policy gives it.
            q: (n,) [rad] the measured joint angles.
            ahead: The action decoded from these angles and the last command, if it is already.
        """
        last = self.last
        started = time.perf_counter() - (ahead.seconds if ahead else 0.0)
        decoded = self._checked(ahead.result if ahead else self._decode(action, q), q)
        status = decoded.status
        follows = status is Status.OK or (self.on_invalid == BEST_EFFORT and status is not Status.INVALID)
        target = self._eased(decoded, action, q) if follows else decoded.q
        latency = time.perf_counter() - started
        self._stopped |= self.on_invalid == STOP and status is not Status.OK
        asked = float(np.abs(decoded.q - last).max())
        nearer = self._limited(last, target)
        follows = follows and not self._stopped and not self._runs_away(nearer, q)
        if follows:
            self._last = nearer
        self.tally.statuses[status] += 1
        self.tally.latencies.append(latency)
        self.tally.largest_step = max(self.tally.largest_step, asked)
        return Command(self.last.copy(), status, latency, decoded.iters, asked, follows, self._stopped)

    def _decode(self, action: ArrayLike, q: ArrayLike) -> IkResult:
        measured = np.asarray(q, dtype=np.float64)
        if not np.all(np.isfinite(measured)):
            return IkResult(self.last, Status.INVALID)
        return self.space.decode(action, seed=measured, current=self.last)

    def _checked(self, decoded: IkResult, q: ArrayLike) -> IkResult:
        """The decoded joints, the last command if there are none; told from joints on another branch."""
        if decoded.status is Status.INVALID:
            return replace(decoded, q=self.last)
        jumps = decoded.status is Status.OK and self._far(decoded.q, np.asarray(q, dtype=np.float64))
        return replace(decoded, status=Status.JUMP) if jumps else decoded

    def _eased(self, decoded: IkResult, action: ArrayLike, q: ArrayLike) -> Vector:
        """The decoded joints or, if they are far or not what the action is about, those near that have its pose."""
        measured = np.asarray(q, dtype=np.float64)
        steady = self.space.steady(action, measured)
        if steady is not None and not self._far(steady, measured):
            return steady
        if not self._far(decoded.q, measured):
            return decoded.q
        eased = self.space.ease(action, measured, JUMP_PERIODS * self._reach, self.last)
        return decoded.q if eased is None else eased

    def _far(self, target: Vector, measured: Vector) -> bool:
        return bool((np.abs(target - measured) > JUMP_PERIODS * self._reach).any())

    def _runs_away(self, command: Vector, q: ArrayLike) -> bool:
        """True if a command would leave behind an arm that does not come along: it waits for it instead."""
        measured = np.asarray(q, dtype=np.float64)
        lead, before = np.abs(command - measured), np.abs(self.last - measured)
        return bool(((lead > LEAD_PERIODS * self._reach) & (lead > before)).any())

    def _limited(self, last: Vector, target: Vector) -> Vector:
        """Go towards the target as far as the slowest joint may; all joints together, on a straight line."""
        way = target - last
        excess = float((np.abs(way) / self._reach).max())
        step = way if excess <= 1.0 else way / excess
        return self.space.arm.within_limits(last + step)
