"""A dataset that does not say which arms it is of, as its user describes it."""

from collections.abc import Sequence

import numpy as np

from er_il.datasets.assembled import Assembled, assembled
from er_il.datasets.changes import are_changes, stays_around_zero
from er_il.datasets.dataset import Dataset
from er_il.datasets.proposals import find_joints, proposal
from er_il.datasets.wiring import JointsNotFoundError, Wiring, wire
from er_il.kinematics.rotation import Quaternion
from er_il.spaces.base import Array
from er_il.spaces.joint import JOINT
from er_il.spaces.layout import Layout, Part
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError


def read_layout(dataset: Dataset, wirings: Sequence[Wiring], option: str = "--arm") -> tuple[Dataset, Layout]:
    """A dataset and the layout of its actions: its own, or in joint space what follows from its user's description.

    Args:
        dataset: The dataset.
        wirings: The arms of a dataset that does not know them; where it does, and its actions are joints, the same.
        option: What declares an arm, for messages.

    Raises:
        ErIlError: neither says which arms it is of, or they contradict each other.
    """
    if not dataset.specified:
        if not wirings:
            raise DatasetError(
                f"{dataset.root} does not say which arm it is of: give {option}, and --joints for its joints."
            )
        return described(dataset, wirings)
    own = dataset.layout
    if wirings and (own.kind != JOINT or wire(wirings, dataset.features, JOINT, Quaternion.kind).spec() != own.spec()):
        raise DatasetError(f"{dataset.root} says which arms it is of: leave out {option} and --arms.")
    return dataset, own


def described(dataset: Dataset, wirings: Sequence[Wiring]) -> tuple[Dataset, Layout]:
    """Read a dataset as its user describes it.

    Args:
        dataset: The dataset as it was recorded.
        wirings: The arms, and where their joints are.

    Returns:
        The dataset, with the joint vectors as ``action`` and the measured joints in ``observation.state``, and the
        layout of the joint vectors in joint space.

    Raises:
        ErIlError: columns, names, numbers or files do not fit; says where the joints seem to be.
    """
    if ACTION not in dataset.features and not any(each.from_ for each in wirings):
        hints = [proposal(dataset, each.build_arm(), each.label) for each in wirings]
        given = "name the columns of the joints with --from or in the file of arms."
        raise DatasetError(" ".join([f"{dataset.root} has no column {ACTION}: {given}", *hints]))
    whole, resolved = assembled(dataset, wirings)
    try:
        layout = wire(resolved, whole.features, JOINT, Quaternion.kind)
    except JointsNotFoundError as error:
        raise DatasetError(f"{error} {proposal(dataset, error.arm, error.label)}") from error
    for part in layout.parts:
        _check_no_changes(dataset, whole, layout, part)
    return whole, layout


def _check_no_changes(recorded: Dataset, dataset: Dataset, layout: Layout, part: Part) -> None:
    """Refuse changes that were taken for angles.

    Raises:
        DatasetError: they are; says where the joints seem to be.
    """
    arm, label = part.space.arm, part.label
    values = dataset.vectors(ACTION)[:, layout.indices(part)].astype(np.float64)
    finite = np.isfinite(values).all(axis=1)
    if not stays_around_zero(values[finite]):  # before units: radians taken for degrees are told by sanity_checks
        return
    measured = _measured(recorded, dataset, layout, part)
    if are_changes(arm, part.motors.angles(values[finite]), None if measured is None else measured[finite]):
        why = "where its joints cannot all be" if measured is None else "its measured joints do not"
        text = (
            f"{', '.join(part.motors.joints)} look like changes (deltas), not like angles of {arm.name}: they stay "
            f"around zero, {why}."
        )
        column = dataset.parts[ACTION].sources[0].column if isinstance(dataset, Assembled) else ACTION
        raise DatasetError(f"{text} {proposal(recorded, arm, label, exclude=column)}")


def _measured(recorded: Dataset, dataset: Dataset, layout: Layout, part: Part) -> Array | None:
    """The measured angles (N, n) [rad] of an arm, by its description or else where they seem to be."""
    vectors = dataset.measured_joints(layout)
    if vectors is not None:
        return layout.angles(part, vectors)
    found = find_joints(recorded, part.space.arm, part.label)
    return next((each.angles() for each in found if each.source.measured), None)
