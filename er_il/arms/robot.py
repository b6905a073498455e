"""Robots by name: one arm, or several that are commanded together, each by its label."""

from collections.abc import Mapping

from er_il.arms.arm import Arm
from er_il.arms.presets import PRESETS, ROBOTS
from er_il.support.errors import UnknownNameError


def robot_arms(name: str) -> Mapping[str, Arm]:
    """Return a robot's arms by their labels, in the order of its vectors; a preset is a robot of one arm, labelled "".

    Raises:
        UnknownNameError: no robot or preset has that name.
    """
    if name in ROBOTS:
        return {label: Arm.preset(preset) for label, preset in ROBOTS[name].items()}
    if name not in PRESETS:
        raise UnknownNameError("arm", name, sorted([*PRESETS, *ROBOTS]))
    return {"": Arm.preset(name)}


def robot_name(arms: Mapping[str, str]) -> str:
    """Name the robot that has the named arms under these labels: the arms' names, joined by +, if none is known."""
    known = (name for name, presets in ROBOTS.items() if presets == arms)
    return next(known, "+".join(arms.values()))


def robot_with(arm: str) -> str:
    """Name the robot that has an arm; the arm itself if it is no part of any."""
    return next((name for name, presets in ROBOTS.items() if arm in presets.values()), arm)
