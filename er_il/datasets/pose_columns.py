"""Where a dataset may hold end-effector poses: by the names of columns and dimensions, or anywhere in a column."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.schema import ENVIRONMENT_STATE, LEADER_JOINTS, SOURCE_ACTION, STATE
from er_il.kinematics.pose_codes import CODES
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError, UnknownNameError

WORDS = {"ee", "eef", "tcp", "hand", "effector", "flange", "pose", "cartesian", "tool"}  # of what is an end effector
AXES = ("x", "y", "z")
LEAST = min(code.width for code in CODES)
WIDEST = 40  # dimensions of a column that is searched though its names say nothing
NOT_MEASURED = (ENVIRONMENT_STATE, SOURCE_ACTION, LEADER_JOINTS)  # of objects, or of joints


@dataclass(frozen=True, eq=False)
class PoseColumn:
    """Numbers (N, k) from some dimension of a column on; a pose is the first of them."""

    column: str
    names: tuple[str, ...]  # (k,)
    values: Floats
    told: bool  # that they are poses, by their names or by the user
    named: bool = False  # by the user
    exact: bool = False  # all k of them are the pose

    @property
    def label(self) -> str:
        """The column, and its first dimension."""
        return self.column if self.names[0] in ("0", *AXES) else f"{self.column} from {self.names[0]} on"


def named_poses(dataset: Dataset, named: Sequence[str]) -> list[PoseColumn]:
    """The poses that a user names: a column and, if it holds more than them, their dimensions.

    Raises:
        DatasetError: there are no such columns or dimensions, or no pose has as many numbers.
    """
    column, *dimensions = named
    if column not in _numeric(dataset):
        raise UnknownNameError("column", column, _numeric(dataset))
    names = dataset.names(column)
    for dimension in dimensions:
        if dimension not in names:
            raise UnknownNameError(f"dimension of {column}", dimension, names)
    widths = sorted({code.width for code in CODES})
    count = len(dimensions or names)
    if count < LEAST or (dimensions and count not in widths):
        raise DatasetError(
            f"{count} numbers are no pose: it has {', '.join(map(str, widths))} (position, then angles, rotation "
            "vector, quaternion, rot6d or matrix)."
        )
    values = dataset.vectors(column)
    if dimensions:
        chosen = values[:, [names.index(each) for each in dimensions]]
        return [PoseColumn(column, tuple(dimensions), chosen, told=True, named=True, exact=True)]
    return [
        PoseColumn(column, names[start:], values[:, start:], told=True, named=True)
        for start in range(count - LEAST + 1)
    ]


def possible_poses(dataset: Dataset, label: str, others: Sequence[str]) -> Iterator[PoseColumn]:
    """Places that may hold the poses of an arm.

    Args:
        dataset: The dataset.
        label: The arm's label; "" if it has none.
        others: Labels of other arms, whose poses are left out.
    """
    for column in _numeric(dataset):
        names = dataset.names(column)
        if len(names) < LEAST or column in NOT_MEASURED or (column == ACTION and dataset.specified):
            continue
        starts = {
            start
            for start in range(len(names) - LEAST + 1)
            if _names_position(names[start : start + 3]) and _is_hand(names[start], label)
        }
        words = _words(column.removeprefix("observation."))
        starts |= {0} if words & WORDS and not starts else set()
        searched = range(len(names) - LEAST + 1) if column == STATE and len(names) <= WIDEST else ()
        values = dataset.vectors(column) if starts or searched else None
        for start in sorted(starts | set(searched)):
            assert values is not None
            if not (_words(column) | _words(names[start])) & {other.lower() for other in others}:
                told = start in starts and not column.startswith(ACTION)  # those may be changes
                yield PoseColumn(column, names[start:], values[:, start:], told)


def _numeric(dataset: Dataset) -> list[str]:
    return [
        name
        for name, feature in dataset.features.items()
        if str(feature["dtype"]).startswith("float") and len(feature["shape"]) == 1
    ]


def _names_position(names: Sequence[str]) -> bool:
    """True of ``ee.x, ee.y, ee.z`` and the like."""
    stems = [re.fullmatch(r"(.*?)([xyz])(\.pos)?", name.lower()) for name in names]
    found = [each.groups() for each in stems if each]
    return [letter for _, letter, _ in found] == list(AXES) and len({stem for stem, *_ in found}) == 1


def _is_hand(name: str, label: str) -> bool:
    """True unless the name of an x says that it is of something else, such as ``cup.x``."""
    words = _words(name) - {"x", "pos", "position", "left", "right", "robot", "arm", label.lower()}
    return not words or bool(words & WORDS)


def _words(name: str) -> set[str]:
    return set(filter(None, re.split(r"[^a-z0-9]+", name.lower())))
