"""Placements of a task's objects, drawn or chosen by hand, and the options of a reset that choose them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from er_il.support.errors import NumbersError, UnknownNameError
from er_il.support.vectors import check_bounds, named_vector

Placement = dict[str, tuple[float, float, float]]  # object: x, y [m], yaw [rad]

STATE, BEYOND_SUCCESS = "state", "beyond_success"  # options of a reset
POSE = ("x", "y", "yaw")
TURN = 2 * np.pi  # [rad] the largest yaw, either way


class OptionError(UnknownNameError, ValueError):
    """An option, or an object to place, that a task does not have."""


@dataclass(frozen=True)
class Area:
    """The rectangle [m] on which a task's objects may be placed: what they stand on."""

    x: tuple[float, float]
    y: tuple[float, float]

    @classmethod
    def around(cls, centre: tuple[float, float], size: tuple[float, float]) -> "Area":
        """The rectangle with a centre and two sides."""
        (x, y), (length, width) = centre, size
        return cls((x - length / 2, x + length / 2), (y - width / 2, y + width / 2))


def yawed(yaw: float) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of a turn [rad] about the vertical."""
    return float(np.cos(yaw / 2)), 0.0, 0.0, float(np.sin(yaw / 2))


def read_options(options: Mapping[str, Any] | None, objects: tuple[str, ...], area: Area) -> tuple[Placement, bool]:
    """What a reset's options say: where objects are placed by hand, and whether the episode goes beyond success.

    Raises:
        OptionError: an option or object is unknown.
        NumbersError: a pose is not finite or beyond the area, or an option is of another type.
        ShapeError: a pose has not three numbers.
    """
    given = options or {}
    for option in given:
        if option not in (STATE, BEYOND_SUCCESS):
            raise OptionError("option of reset", option, (STATE, BEYOND_SUCCESS))
    state, beyond_success = given.get(STATE, {}), given.get(BEYOND_SUCCESS, False)
    if not isinstance(beyond_success, bool):
        raise NumbersError(f"The option {BEYOND_SUCCESS} is {beyond_success!r}, expected True or False.")
    if not isinstance(state, Mapping):
        raise NumbersError(f"The option {STATE} is {state!r}, expected a pose (x, y, yaw) by object.")
    lower, upper = np.array([area.x[0], area.y[0], -TURN]), np.array([area.x[1], area.y[1], TURN])
    placement: Placement = {}
    for name, place in state.items():
        if name not in objects:
            raise OptionError("object", name, objects)
        what = f"The pose of {name}"
        pose = named_vector(what, place, POSE)
        check_bounds(what, pose, POSE, lower, upper)
        x, y, yaw = pose.tolist()
        placement[name] = (x, y, yaw)
    return placement, beyond_success
