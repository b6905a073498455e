"""Motors: how a robot's joint values, by name and in its units, become the angles of its URDF."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.support.errors import DatasetError, UnknownNameError

Array = NDArray[np.float64]

UNITS = {"rad": 1.0, "deg": np.pi / 180.0}


@dataclass(frozen=True)
class Motors:
    """Joint values of one arm, in the order of the arm's joints.

        q [rad] = unit · (sign · value + offset)

    Raises:
        UnknownNameError: the unit is not known.
        DatasetError: numbers of joints, signs and offsets differ, or a sign is not 1 or -1.
    """

    joints: tuple[str, ...]  # names of the dimensions that hold them
    units: str = "rad"
    signs: tuple[float, ...] = ()  # 1 each if empty
    offsets: tuple[float, ...] = ()  # [units] 0 each if empty
    state: tuple[str, ...] = ()  # names of their measured values in the state; empty if there are none

    def __post_init__(self) -> None:
        if self.units not in UNITS:
            raise UnknownNameError("unit", self.units, UNITS)
        for what, values in (("signs", self.signs), ("offsets", self.offsets), ("joints in the state", self.state)):
            if values and len(values) != len(self.joints):
                raise DatasetError(f"{len(values)} {what} were given for {len(self.joints)} joints.")
        if any(sign not in (1, -1) for sign in self.signs):
            raise DatasetError(f"A sign is 1 or -1, not as in {' '.join(f'{sign:g}' for sign in self.signs)}.")

    @property
    def plain(self) -> bool:
        """True if values are the URDF's angles without conversion."""
        return self.units == "rad" and all(s == 1 for s in self.signs) and not any(self.offsets)

    @property
    def measured(self) -> tuple[str, ...]:
        """Names of the measured values in the state; where nothing says others, those of the commanded ones."""
        return self.state or self.joints

    def angles(self, values: ArrayLike) -> Array:
        """Angles (..., n) [rad] of the URDF's joints from the robot's values (..., n)."""
        return UNITS[self.units] * (np.asarray(values, dtype=np.float64) * self._signs + self._offsets)

    def values(self, angles: ArrayLike) -> Array:
        """The robot's values (..., n) from angles (..., n) [rad]."""
        return (np.asarray(angles, dtype=np.float64) / UNITS[self.units] - self._offsets) * self._signs

    @cached_property
    def _signs(self) -> Array:
        return np.array(self.signs) if self.signs else np.ones(len(self.joints))

    @cached_property
    def _offsets(self) -> Array:
        return np.array(self.offsets) if self.offsets else np.zeros(len(self.joints))

    def spec(self) -> dict[str, Any]:
        """Describe the motors as JSON."""
        return {name: value if isinstance(value, str) else list(value) for name, value in asdict(self).items()}

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Motors":
        """Rebuild what :meth:`spec` described."""
        signs, offsets, state = (tuple(spec[name]) for name in ("signs", "offsets", "state"))
        return cls(tuple(spec["joints"]), spec["units"], signs, offsets, state)
