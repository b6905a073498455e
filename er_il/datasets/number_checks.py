"""Checks of a dataset's numbers where they enter a command: finite, possible, and in one unit, told by episode.

What is wrong is found in whole columns at once: a sound column costs two passes over it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.sanity_checks import JointSample, check_joint_values
from er_il.datasets.schema import STATE
from er_il.spaces.layout import Layout
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError

Array = NDArray[np.float64]
Problems = dict[int, list[str]]  # what is wrong in an episode, by its number

BEYOND = 2 * np.pi  # [rad] a joint this far beyond its limit is not where any arm was
ENCODED = 20.0  # [m], [rad] no dimension of an arm's encoded action is larger
LARGEST = 1e6  # no other value of a robot is larger, whatever its unit
STILL = 0.05  # columns whose values are this small on average, in the larger unit, tell nothing of their units
SHARE = 0.2  # of the difference between two columns that may remain once one of them is converted
EPISODES, DIMENSIONS = 10, 4  # that a message lists; the rest it counts
DEGREES = np.float32(180 / np.pi)


@dataclass(frozen=True, eq=False)
class Range:
    """What the values of a column (N, D) may be."""

    column: str
    names: tuple[str, ...]  # (D,)
    lower: Array  # (D,)
    upper: Array  # (D,)


def check_numbers(dataset: Dataset, layout: Layout, columns: Sequence[str] = (), episode: int | None = None) -> None:
    """Refuse a dataset whose actions, joints, state or further columns hold numbers that cannot be.

    Args:
        dataset: The dataset.
        layout: What its joint vectors, and its actions if they are encoded, mean.
        columns: Further columns of vectors that are read.
        episode: The only episode that is read; all if omitted.

    Raises:
        DatasetError: names episodes, dimensions, values and frames.
    """
    if problems := number_problems(dataset, layout, columns, episode):
        text = " ".join([*_causes(dataset, layout), described(problems, len(dataset.episodes))])
        raise DatasetError(f"{dataset.root}: {text}")


def _causes(dataset: Dataset, layout: Layout) -> list[str]:
    """What would explain the joint values of each arm that are wrong throughout."""
    if (joints := dataset.joints_column(layout)) is None:
        return []
    values = dataset.vectors(joints).astype(np.float64)
    samples = [JointSample(part.space.arm, part.motors, values[:, layout.indices(part)], None) for part in layout.parts]
    return list(filter(None, map(check_joint_values, samples)))


def described(problems: Problems, episodes: int) -> str:
    """The problems of a dataset of so many episodes in one line."""
    listed = []
    for number, texts in list(problems.items())[:EPISODES]:
        more = f", and {len(texts) - DIMENSIONS} more" if len(texts) > DIMENSIONS else ""
        listed.append(f"episode {number}: {', '.join(texts[:DIMENSIONS])}{more}")
    if len(problems) > EPISODES:
        listed.append(f"and {len(problems) - EPISODES} more episodes")
    return f"{len(problems)} of {episodes} episodes are not sound: {'; '.join(listed)}."


def number_problems(
    dataset: Dataset, layout: Layout, columns: Sequence[str] = (), episode: int | None = None
) -> Problems:
    """What is wrong with a dataset's numbers; see :func:`check_numbers`."""
    rows, read = dataset.episodes, slice(None)
    if episode is not None:
        read = rows[episode]
        rows = {episode: slice(0, read.stop - read.start)}
    joints = dataset.joints_column(layout)
    wanted = {ACTION, STATE, joints, *columns} & dataset.features.keys()
    values = {str(name): dataset.vectors(str(name))[read] for name in sorted(wanted, key=str)}
    found: Problems = {}
    for name, array in values.items():
        _add(found, _out_of_range(array, _range(dataset, layout, name, joints), rows))
    if joints and STATE in values and (pairs := _pairs(layout, dataset.names(STATE))):
        commanded = values[joints][:, [layout.names.index(name) for name in pairs]]
        measured = values[STATE][:, [dataset.names(STATE).index(name) for name in pairs.values()]]
        _add(found, _other_units(commanded, measured, pairs, rows))
    return dict(sorted(found.items()))


def _add(found: Problems, more: Problems) -> None:
    for number, texts in more.items():
        found.setdefault(number, []).extend(texts)


def _range(dataset: Dataset, layout: Layout, column: str, joints: str | None) -> Range:
    names = dataset.names(column)
    lower, upper = np.full(len(names), -LARGEST), np.full(len(names), LARGEST)
    for part in layout.parts:
        if column in (joints, STATE):
            arm, motors = part.space.arm, part.motors
            ends = np.sort([motors.values(arm.lower - BEYOND), motors.values(arm.upper + BEYOND)], axis=0)
            joint_names = motors.state if column == STATE else motors.joints
            for name, low, high in zip(joint_names, *ends.tolist(), strict=False):  # the state may measure none
                if name in names:
                    lower[names.index(name)], upper[names.index(name)] = low, high
        elif column == ACTION:
            own = [names.index(name) for name in part.names if name in names]
            lower[own], upper[own] = -ENCODED, ENCODED
    return Range(column, names, lower, upper)


def _out_of_range(values: Floats, allowed: Range, rows: Mapping[int, slice]) -> Problems:
    """Values that are not finite or out of range."""
    with np.errstate(invalid="ignore"):
        inside = (values.min(axis=0) >= allowed.lower) & (values.max(axis=0) <= allowed.upper)  # NaN is not
    suspects = np.flatnonzero(~inside)
    if not len(suspects):
        return {}
    chosen = values[:, suspects].astype(np.float64)
    bad = ~((chosen >= allowed.lower[suspects]) & (chosen <= allowed.upper[suspects]))
    found: Problems = {}
    for number, each in rows.items():
        for column in np.flatnonzero(bad[each].any(axis=0)).tolist():
            frames = np.flatnonzero(bad[each, column])
            value, count = chosen[each, column][frames[0]], len(frames)
            text = f"{allowed.column} {allowed.names[suspects[column]]} is {value:.4g} in frame {frames[0]}"
            found.setdefault(number, []).append(text + (f" and {count - 1} more" if count > 1 else ""))
    return found


def _pairs(layout: Layout, state: Sequence[str]) -> dict[str, str]:
    """Dimensions of the joint vector, and those of the state that measure the same."""
    pairs = {name: name for name in layout.other_dimensions if name in state}
    for part in layout.parts:
        own = zip(part.motors.joints, part.motors.state, strict=False)  # the state may measure none
        pairs |= {joint: measured for joint, measured in own if measured in state}
    return pairs


def _other_units(commanded: Floats, measured: Floats, pairs: Mapping[str, str], rows: Mapping[int, slice]) -> Problems:
    """Dimensions that are commanded in degrees and measured in radians, or the other way.

    Args:
        commanded: (N, k) values of the dimensions ``pairs``.
        measured: (N, k) what was measured of each.
        pairs: Names of the dimensions in the joint vector, and in the state.
        rows: Rows of each episode.
    """
    starts = [each.start for each in rows.values()]

    def size(values: NDArray[np.floating[Any]]) -> Array:
        """Mean sizes (E, k) by episode."""
        lengths = [[each.stop - each.start] for each in rows.values()]
        return np.add.reduceat(np.abs(values), starts, axis=0, dtype=np.float64) / lengths

    found: Problems = {}
    with np.errstate(all="ignore"):  # numbers that cannot be are told elsewhere; no comparison holds for them
        apart = size(commanded - measured)
        for larger, smaller, units in (
            (commanded, measured, "degrees but measured in radians"),
            (measured, commanded, "radians but measured in degrees"),
        ):
            fits = (size(larger - DEGREES * smaller) < SHARE * apart) & (size(larger) > STILL)
            for episode, number in enumerate(rows):
                if names := [name for name, fit in zip(pairs, fits[episode], strict=True) if fit]:
                    found.setdefault(number, []).append(f"{', '.join(names)} commanded in {units}")
    return found
