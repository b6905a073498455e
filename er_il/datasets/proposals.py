"""Where the joints of an arm seem to be in a dataset, and the options that say so."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from er_il.arms.arm import Arm
from er_il.datasets.changes import stays_around_zero
from er_il.datasets.column_source import ColumnSource, vector_columns
from er_il.datasets.dataset import Dataset
from er_il.datasets.sanity_checks import OUTSIDE_TOLERANCE, share_outside
from er_il.datasets.schema import SOURCE, STATE
from er_il.datasets.wiring import joints_named_as
from er_il.spaces.base import Array
from er_il.spaces.motors import UNITS
from er_il.spaces.spec import ACTION

MOST = 3  # that are named
SAMPLES = 500  # frames that are looked at
TURN = 2 * np.pi + 0.1  # [rad] values beyond are degrees
STILL = 1e-3  # [rad] a column that moves less tells nothing
NO_ANGLES = re.compile(r"vel|effort|torque|current|accel|force|wrench|cartesian|pose|eef|ee_|end[._]|tcp|delta", re.I)
GRIPPER = re.compile(r"gripper|effector|hand|finger", re.I)
POSE = re.compile(r"((ee|eef|tcp|hand|pose|pos|rot|left|right)[._]?)*(r?[xyz]|q[xyzw]|roll|pitch|yaw)", re.I)


@dataclass(frozen=True)
class Proposal:
    """Dimensions of a column whose values could be an arm's joints."""

    source: ColumnSource  # the joints alone, base first
    units: str

    @property
    def text(self) -> str:
        """The column, its dimensions, their units, and whether they were measured."""
        names = ", ".join(self.source.names) if self.source.named else f"dimensions {', '.join(self.source.names)}"
        return f"{self.source.column} ({names}; {self.units}{', measured' if self.source.measured else ''})"

    @property
    def rest(self) -> list[str]:
        """The other dimensions of the column."""
        return [name for name in self.source.dataset.names(self.source.column) if name not in self.source.names]

    def angles(self) -> Array:
        """The angles (N, n) [rad]."""
        return self.source.read().astype(np.float64) * UNITS[self.units]


def find_joints(dataset: Dataset, arm: Arm, label: str = "", exclude: str = "") -> list[Proposal]:
    """Columns that could hold the joints of an arm: within its limits, and not around zero unless their names say so.

    Args:
        dataset: The dataset as it was recorded.
        arm: The arm.
        label: What the arm's dimensions may have in their names, such as "left".
        exclude: A column that is known to hold something else.
    """
    found = []
    for column in vector_columns(dataset):
        if column == exclude or column.startswith(SOURCE) or NO_ANGLES.search(column):
            continue
        if own := _in_column(dataset, column, arm, label):
            found.append(own)
    return sorted(
        found,
        key=lambda each: (each.source.measured, each.source.column != ACTION, label not in each.source.column.lower()),
    )


def proposal(dataset: Dataset, arm: Arm, label: str = "", exclude: str = "") -> str:
    """Where the joints of an arm seem to be and what to give, in a sentence or two; see :func:`find_joints`."""
    found = find_joints(dataset, arm, label, exclude)
    if not found:
        return (
            f"No column of {dataset.root} seems to hold the joints of {label or arm.name}. If another dataset of the "
            "same frames does, give --from DATASET:COLUMN."
        )
    keys = _keys(dataset, arm, found)
    if label:
        lists = {key: "deg" if key == "units" else _yaml(values) for key, values in keys.items()}
        given = f"{', '.join(f'{key}: {text}' for key, text in lists.items())} in its entry of the file of arms"
    else:
        given = " ".join(f"--{key.replace('_', '-')} {' '.join(values)}" for key, values in keys.items())
    others = f" Or in {'; '.join(each.text for each in found[1:MOST])}." if found[1:] else ""
    return f"The joints of {label or arm.name} seem to be in {found[0].text}: give {given}.{others}"


def _yaml(values: Sequence[str]) -> str:
    return f"[{', '.join(f'"{value}"' if ':' in value else value for value in values)}]"


def _in_column(dataset: Dataset, column: str, arm: Arm, label: str) -> Proposal | None:
    """The likeliest dimensions of a column whose values could be the arm's."""
    names = dataset.names(column)
    candidates = list(_candidates(arm, names, label))
    if not candidates:
        return None
    rows = np.unique(np.linspace(0, dataset.frames - 1, SAMPLES).astype(int))
    values = dataset.vectors(column)[rows].astype(np.float64)
    for chosen in candidates:
        own = values[:, [names.index(name) for name in chosen]]
        units = "rad" if np.abs(own).max() <= TURN else "deg"
        q = own * UNITS[units]
        moves = np.isfinite(q).all() and np.ptp(q, axis=0).max() > STILL
        if not moves or share_outside(arm, q) > OUTSIDE_TOLERANCE:
            continue
        if not stays_around_zero(q) or any("joint" in name for name in (column, *chosen)):
            return Proposal(ColumnSource(dataset, column, chosen), units)
    return None


def _candidates(arm: Arm, names: Sequence[str], label: str) -> Iterator[tuple[str, ...]]:
    """Dimensions that could be the joints of an arm by their names, the likeliest first."""
    if named := joints_named_as(arm, names) or _spelt_otherwise(arm, names):
        yield named
    if all(name.isdecimal() for name in names):
        halves = (0, len(names) // 2)  # of two arms, perhaps, the left one first
        for first in reversed(halves) if "right" in label.lower() else halves:
            if len(chosen := tuple(names[first : first + arm.dof])) == arm.dof:
                yield chosen
        return
    possible = [name for name in names if not (POSE.fullmatch(name) or GRIPPER.search(name) or NO_ANGLES.search(name))]
    groups: dict[str, list[str]] = {}
    for name in possible:
        groups.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    sides = ([name for name in possible if side in name.lower()] for side in ("left", "right"))
    fitting = [group for group in (*groups.values(), *sides, possible) if len(group) == arm.dof]
    for group in sorted(fitting, key=lambda each: not all(label in name.lower() for name in each)):
        yield tuple(sorted(group, key=_number) if all(re.search(r"\d", name) for name in group) else group)


def _number(name: str) -> int:
    return int(re.findall(r"\d+", name)[-1])


def _spelt_otherwise(arm: Arm, names: Sequence[str]) -> tuple[str, ...] | None:
    """Dimensions named as the arm's joints but for spelling: ``kLeftElbow`` for ``left_elbow_joint``."""

    def letters(name: str) -> str:
        return re.sub(r"^k(?=[A-Z])|[^A-Za-z0-9]|joint|\.(pos|q)$", "", name).lower()

    spelt = {letters(name): name for name in names}
    wanted = [letters(joint) for joint in arm.joints]
    return tuple(spelt[each] for each in wanted) if set(wanted) <= set(spelt) else None


def _keys(dataset: Dataset, arm: Arm, found: Sequence[Proposal]) -> dict[str, list[str]]:
    """What to declare so that the first proposal is read, by the keys of a file of arms."""
    best = found[0]
    gripper = _gripper(dataset, best)
    keys: dict[str, list[str]] = {}
    if gripper:
        keys["from"] = [best.source.text, gripper]
    elif best.source.column != ACTION:
        keys["from"] = [best.source.column]
    if not gripper and joints_named_as(arm, best.source.names) is None and (best.rest or best.source.column == ACTION):
        keys["joints"] = list(best.source.names)
    keys |= _state_keys(dataset, best, [each for each in found if each.source.measured])
    return keys | ({"units": [best.units]} if best.units != "rad" else {})


def _state_keys(dataset: Dataset, best: Proposal, measured: Sequence[Proposal]) -> dict[str, list[str]]:
    """What to declare so that the joints are known as measured, where that does not follow from their names."""
    in_state = next((each for each in measured if each.source.column == STATE), None)
    if in_state is None:
        here = [STATE] if STATE in dataset.features else []
        return {"state_from": [measured[0].source.text, *here]} if measured else {}
    same = in_state.source.names == best.source.names and (best.source.named or best.source.column in (ACTION, STATE))
    return {} if same else {"state_joints": list(in_state.source.names)}


def _gripper(dataset: Dataset, joints: Proposal) -> str:
    """Where a gripper is commanded, if not beside commanded joints; "" if nowhere."""
    if not joints.source.measured and any(GRIPPER.search(name) for name in joints.rest):
        return ""
    for column, feature in dataset.features.items():
        commanded = column.startswith(ACTION) and "vel" not in column and len(feature["shape"]) == 1
        if not commanded or column == joints.source.column:
            continue
        if GRIPPER.search(column):
            return column
        if dimensions := [name for name in dataset.names(column) if GRIPPER.search(name)]:
            return f"{column}:{','.join(dimensions)}"
    return ""
