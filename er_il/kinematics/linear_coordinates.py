"""Linear coordinates (ERX): combinations W q of the joints, of which ERJ's joints are the special case.

A redundancy folds where the self-motion leaves it still: ERJ's joint where |n_i| = 0 of the unit self-motion n, a
coordinate w.q where w.n = 0. With all joints to choose from, w can stay far from that wherever the arm works
(:mod:`er_il.spaces.margin`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from er_il.arms.arm import Weights
from er_il.kinematics.redundancy import Array, LinearRedundancy
from er_il.support.errors import ArmError, SpecError

NAME = "self_motion"
TINY = 0.005  # weights below this are not told to people
SPEC_KEY = "linear_coordinates"  # of a specification


@dataclass(frozen=True, eq=False)
class LinearCoordinates(LinearRedundancy):
    """The coordinates W q of one arm (ERX), each in radians of the joints' common way along its row."""

    rows: Weights  # W (m, n), rows orthonormal

    @property
    def names(self) -> tuple[str, ...]:
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        count = len(self.rows)
        return (NAME,) if count == 1 else tuple(f"{NAME}_{i}" for i in range(1, count + 1))

    @cached_property
    def weights(self) -> Array:
        return np.array(self.rows)

    def formula(self, name: str) -> str:
        """A coordinate as a sum of joints, for people: ``0.74 joint1 - 0.43 joint3``, tiny weights left out."""
        weighed = zip(self.rows[self.names.index(name)], self.arm.joints, strict=True)
        terms = [
            f"{'-' if weight < 0 else '+'} {abs(weight):.2f} {joint}"
            for weight, joint in weighed
            if abs(weight) >= TINY
        ]
        return " ".join(terms).removeprefix("+ ")

    def details(self) -> dict[str, Any]:
        return {SPEC_KEY: {"joints": list(self.arm.joints), "weights": [list(row) for row in self.rows]}}

    def restored(self, spec: Mapping[str, Any]) -> "LinearCoordinates":
        described = spec[SPEC_KEY]
        if tuple(described["joints"]) != self.arm.joints:
            raise SpecError(
                f"The action spec weighs {', '.join(described['joints'])}, but the joints of {self.arm.name!r} are "
                f"{', '.join(self.arm.joints)}."
            )
        try:
            arm = self.arm.weighing(described["weights"])
        except ArmError as error:
            raise SpecError(str(error)) from error
        return LinearCoordinates(arm, arm.weights)
