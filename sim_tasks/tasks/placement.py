"""Placements of a task's objects, drawn or chosen by hand."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from er_il.support.errors import NumbersError, UnknownNameError
from er_il.support.vectors import check_bounds, named_vector

Placement = dict[str, tuple[float, float, float]]  # object: x, y [m], yaw [rad]

STATE = "state"  # the option of a reset that places objects
POSE = ("x", "y", "yaw")
TURN = 2 * np.pi  # [rad] the largest yaw, either way


class PlacementError(UnknownNameError, NumbersError):
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


def chosen_placement(options: Mapping[str, Any] | None, objects: tuple[str, ...], area: Area) -> Placement:
    """The objects that a reset's options place by hand: ``{"state": {name: (x, y, yaw)}}``.

    Raises:
        PlacementError: an option or object is unknown.
        NumbersError: a pose is not finite or beyond the area, or no pose.
        ShapeError: a pose has not three numbers.
    """
    for option in options or {}:
        if option != STATE:
            raise PlacementError("option of reset", option, [STATE])
    state = (options or {}).get(STATE, {})
    if not isinstance(state, Mapping):
        raise NumbersError(f"The option {STATE} is {state!r}, expected a pose (x, y, yaw) by object.")
    lower, upper = np.array([area.x[0], area.y[0], -TURN]), np.array([area.x[1], area.y[1], TURN])
    placement: Placement = {}
    for name, given in state.items():
        if name not in objects:
            raise PlacementError("object", name, objects)
        what = f"The pose of {name}"
        pose = named_vector(what, given, POSE)
        check_bounds(what, pose, POSE, lower, upper)
        x, y, yaw = pose.tolist()
        placement[name] = (x, y, yaw)
    return placement
