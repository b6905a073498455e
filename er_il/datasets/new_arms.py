"""Other arms in the places of a robot's: their dimensions, and the names that stand where the old ones did."""

from collections.abc import Sequence

from er_il.datasets.wiring import SUFFIX, Wiring
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout, Part
from er_il.spaces.motors import Motors
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import DatasetError

Exchange = tuple[Sequence[str], Sequence[str]]  # names of dimensions, and those that stand in their place


def new_parts(known: Layout, to: Sequence[Wiring]) -> dict[str, Part]:
    """The new arms in joint space by the label of the old one; dimensions bear their joints' names if not said.

    Args:
        known: The layout of the old arms.
        to: The new ones, under the same labels; of one arm, under any.

    Raises:
        ErIlError: labels or files do not fit.
    """
    labels = [part.label for part in known.parts]
    given = {labels[0]: to[0]} if len(labels) == len(to) == 1 else {wiring.label: wiring for wiring in to}
    if set(given) != set(labels):
        raise DatasetError(
            f"The dataset has several arms: {', '.join(labels)}. Give --to a file of arms with an entry for each."
            if len(labels) > 1
            else f"The dataset has one arm, but --to several: {', '.join(given)}."
        )
    parts = {}
    for old in known.parts:
        wiring, arm = given[old.label], given[old.label].build_arm()
        prefix = f"{old.label}_" if old.label else ""
        joints = wiring.joints or tuple(f"{prefix}{joint}{SUFFIX}" for joint in arm.joints)
        state = (wiring.state_joints or joints) if old.motors.state else ()
        motors = Motors(joints, wiring.units, wiring.signs, wiring.offsets, state)
        parts[old.label] = Part(old.label, make_arm_space(JOINT, arm), motors)
    return parts


def exchanged(names: Sequence[str], exchanges: Sequence[Exchange]) -> tuple[str, ...]:
    """Names with some of them exchanged, the new ones where the first of the old ones was."""
    found: list[str] = []
    for name in names:
        old, new = next((each for each in exchanges if name in each[0]), ((name,), (name,)))
        if name == next(each for each in names if each in old):
            found += new
    return tuple(found)
