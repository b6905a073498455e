"""The commander of a robot's whole vector: each arm with its own commander, everything else passed through."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Vector
from er_il.control.commander import BEST_EFFORT, Command, Commander, DecodedAhead
from er_il.spaces.layout import Layout
from er_il.support.errors import ErIlError, ShapeError
from er_il.support.vectors import named_vector


@dataclass(frozen=True)
class VectorCommand:
    """The joint vector of one control period."""

    vector: Vector  # (D,) the robot's values, in its units; finite
    arms: tuple[Command, ...]


class VectorCommander:
    """Decodes encoded vectors to joint vectors that the arms of a layout can follow.

    Each arm is limited as :class:`er_il.control.commander.Commander` says. Once one arm stops, all do. What
    belongs to no arm (grippers, say) passes through as it is, as long as every arm follows; a value that is not
    finite leaves the last one standing.
    """

    def __init__(self, layout: Layout, period: float, on_invalid: str = BEST_EFFORT) -> None:
        """Prepare for a control period [s]; see :class:`er_il.control.commander.Commander` for ``on_invalid``.

        Raises:
            UnknownNameError: ``on_invalid`` is no valid answer.
        """
        self.layout = layout
        self.on_invalid = on_invalid
        self.arms = tuple(Commander(part.space, period, on_invalid) for part in layout.parts)
        self._others: Vector | None = None  # the last values of what belongs to no arm

    def reset(self, measured: ArrayLike) -> None:
        """Start an episode from the measured values (D,); NaN for dimensions of no arm that are not measured."""
        angles, self._others = self.split_measured(measured)
        for arm, q in zip(self.arms, angles, strict=True):
            arm.reset(q)

    def anchor(self, measured: ArrayLike) -> None:
        """Go on from the measured values (D,), wherever the last command was."""
        for arm, q in zip(self.arms, self.split_measured(measured)[0], strict=True):
            arm.anchor(q)

    def command(
        self, action: ArrayLike, measured: ArrayLike, ahead: Sequence[DecodedAhead] | None = None
    ) -> VectorCommand:
        """Turn an encoded vector into the next joint vector.

        Args:
            action: (len(layout.encoded_names),) as a policy gives it.
            measured: (D,) the robot's values; those of dimensions that belong to no arm are not read.
            ahead: Each arm's action, if it is decoded already.

        Raises:
            NumbersError: the action holds anything but real numbers; NaN and infinity are numbers.
            ShapeError: a vector has another length.
            ErIlError: nothing finite was ever commanded or measured of a dimension that belongs to no arm.
        """
        if self._others is None:
            raise RuntimeError("VectorCommander.reset must be called before the first command.")
        layout = self.layout
        own, others = self.split_action(action)
        angles, _ = self.split_measured(measured)
        decoded = ahead or [None] * len(own)
        parts = zip(self.arms, own, angles, decoded, strict=True)
        commands = tuple(arm.command(action, q, each) for arm, action, q, each in parts)
        if any(each.stopped for each in commands):
            for arm in self.arms:
                arm.stop()
        if all(each.followed for each in commands):
            self._others = np.where(np.isfinite(others), others, self._others)
        if not np.isfinite(self._others).all():
            values = zip(layout.other_dimensions, self._others, strict=True)
            unknown = ", ".join(name for name, value in values if not np.isfinite(value))
            raise ErIlError(f"Nothing is known of {unknown}: the action is not finite, nor is it measured.")
        return VectorCommand(layout.join([each.q for each in commands], self._others), commands)

    def split_action(self, action: ArrayLike) -> tuple[list[Vector], Vector]:
        """Split an encoded vector into each arm's action (dim,) and the other dimensions.

        Raises:
            NumbersError: it holds anything but real numbers.
            ShapeError: it has another length.
        """
        return self.layout.split_encoded(named_vector("The policy's action", action, self.layout.encoded_names))

    def split_measured(self, measured: ArrayLike) -> tuple[list[Vector], Vector]:
        """Split measured values (D,) into each arm's angles (n,) [rad] and the other dimensions.

        Raises:
            ShapeError: they have another length.
        """
        values = np.asarray(measured, dtype=np.float64)
        if values.shape != (len(self.layout.names),):
            raise ShapeError("Measured values", values.shape, f"({len(self.layout.names)},)")
        return self.layout.split(values)
