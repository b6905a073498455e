"""A layout's joint vector by the names of the robot that has these joints."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from er_il.arms.arm import Vector
from er_il.robots.hardware.joints import POSITION
from er_il.robots.processors import measured_names
from er_il.spaces.layout import Layout
from er_il.support.errors import ErIlError

BEYOND = 0.5  # [rad] outside of its limits, no arm measures a joint in the right units


def bare(name: str) -> str:
    """A name without the ending that some datasets leave out: ``gripper`` of ``gripper.pos``."""
    return name.removesuffix(POSITION)


class JointVector:
    """Reads a layout's joint vector (D,) from a robot's observations, and names it for the robot's actions."""

    def __init__(self, layout: Layout, takes: Sequence[str], measures: Sequence[str]) -> None:
        """Find a layout's dimensions in a robot.

        Args:
            layout: The layout.
            takes: Names of the robot's actions.
            measures: Names of the numbers that it observes.

        Raises:
            ErIlError: the robot lacks a dimension, or does not measure a joint.
        """
        self._layout = layout
        self.names = _found(layout.names, takes, "takes")
        where = measured_names(layout)
        _found([where[joint] for part in layout.parts for joint in part.motors.joints], measures, "measures")
        known = {bare(name): name for name in measures}
        self._where = tuple(known.get(bare(where[name]), "") for name in layout.names)  # "" where nothing measures

    def measured(self, observation: Mapping[str, Any]) -> Vector:
        """The measured values (D,); NaN in dimensions of no arm that the robot does not measure."""
        return np.array([float(observation[name]) if name else np.nan for name in self._where])

    def named(self, vector: Vector) -> dict[str, float]:
        """The robot's action of a vector (D,)."""
        return dict(zip(self.names, vector.tolist(), strict=True))

    def check(self, measured: Vector) -> None:
        """Refuse measured values (D,) that no arm of the layout can have.

        Raises:
            ErIlError: a joint is far outside of its limits.
        """
        for part in self._layout.parts:
            arm, q = part.space.arm, self._layout.angles(part, measured)
            beyond = np.maximum(arm.lower - q, q - arm.upper) > BEYOND
            if beyond.any():
                values = measured[self._layout.indices(part)]
                told = zip(part.motors.joints, values, beyond, strict=True)
                listed = ", ".join(f"{name} {value:.6g}" for name, value, far in told if far)
                raise ErIlError(
                    f"The robot measures {listed}, far outside of the limits of {arm.name}: check its units "
                    f"({part.motors.units}), signs and offsets, and the arm."
                )


def _found(names: Sequence[str], offered: Iterable[str], what: str) -> tuple[str, ...]:
    """The names by which a robot knows dimensions.

    Raises:
        ErIlError: it does not know one.
    """
    known = {bare(name): name for name in offered}
    if missing := [name for name in names if bare(name) not in known]:
        raise ErIlError(f"The inner robot {what} no {', '.join(missing)}; it {what} {', '.join(known.values())}.")
    return tuple(known[bare(name)] for name in names)
