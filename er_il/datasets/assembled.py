"""A dataset whose joint vectors and measured joints are put together from its columns, as its user describes it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.datasets.column_source import ColumnSource
from er_il.datasets.dataset import Dataset, Floats
from er_il.datasets.schema import STATE, Feature
from er_il.datasets.wiring import Wiring, joints_named_as
from er_il.spaces.spec import ACTION
from er_il.support.errors import DatasetError, UnknownNameError


@dataclass(frozen=True, eq=False)
class Assembly:
    """The vectors that columns make, one beside the other."""

    sources: tuple[ColumnSource, ...]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the dimensions."""
        return tuple(name for source in self.sources for name in self.names_of(source).values())

    def names_of(self, source: ColumnSource) -> dict[str, str]:
        """The name of each dimension of a column in the vectors.

        Where two columns have the same name, and before numbers, stands the column's: the third dimension of one column
        is not the third of another. LeRobot's own columns, alone, keep their names.
        """
        every = Counter(name for each in self.sources for name in each.names)
        alone = len(self.sources) == 1 and source.column in (ACTION, STATE)
        distinct = source.named and all(every[name] == 1 for name in source.names)
        prefix = "" if alone or distinct else f"{source.column}."
        return {name: prefix + name for name in source.names}

    @property
    def feature(self) -> Feature:
        """The vectors as a column."""
        return {"dtype": "float32", "shape": (len(self.names),), "names": list(self.names)}


@dataclass(frozen=True, eq=False)
class Assembled(Dataset):
    """A dataset as if its joint vectors were its actions, and measured joints its state.

    Whatever reads a dataset reads the vectors as ``action`` and ``observation.state``; the files stay as they are.
    """

    parts: Mapping[str, Assembly] = field(default_factory=dict)  # by the column that they stand for

    @cached_property
    def recorded(self) -> Dataset:
        """The dataset as it was recorded."""
        return Dataset(self.root)

    @cached_property
    def info(self) -> dict[str, Any]:
        info = self.recorded.info
        return info | {"features": info["features"] | {name: each.feature for name, each in self.parts.items()}}

    def column(self, name: str) -> NDArray[Any]:
        return self._vectors(name) if name in self.parts else self.recorded.column(name)

    def _vectors(self, name: str) -> Floats:
        sources = self.parts[name].sources
        return np.hstack([source.commands() if name == ACTION else source.read() for source in sources])

    @property
    def measured(self) -> tuple[str, ...]:
        """Columns that were measured, and stand for commands."""
        sources = self.parts[ACTION].sources if ACTION in self.parts else ()
        return tuple(source.column for source in sources if source.measured)


def assembled(dataset: Dataset, wirings: Sequence[Wiring]) -> tuple[Dataset, list[Wiring]]:
    """Put the joint vectors together from the columns that the arms are in.

    Returns:
        The dataset, itself if the arms are in its actions and state; the arms, with their joints by the names that
        these have in the vectors.

    Raises:
        ErIlError: there is no such column or dimension, or two arms share one.
    """
    elsewhere = any(set(each.from_) - {ACTION} for each in wirings)
    state_elsewhere = any(set(each.state_from) - {STATE} for each in wirings)
    if not (elsewhere or state_elsewhere):
        return dataset, list(wirings)
    here = (STATE,) if STATE in dataset.features else ()
    actions = [_sources(dataset, each.from_ or (ACTION,)) for each in wirings]
    states = [_sources(dataset, each.state_from or here) for each in wirings]
    parts = {}
    if elsewhere:
        parts[ACTION] = _assembly(actions)
    if state_elsewhere:
        parts[STATE] = _assembly(states)
    action, state = parts.get(ACTION) or _assembly(actions), parts.get(STATE) or _assembly(states)
    resolved = [
        _resolved(wiring, _Found(action, own), _Found(state, measured))
        for wiring, own, measured in zip(wirings, actions, states, strict=True)
    ]
    return Assembled(dataset.root, parts), resolved


@dataclass(frozen=True, eq=False)
class _Found:
    """The columns in which one arm is, among those of all."""

    assembly: Assembly
    sources: tuple[ColumnSource, ...]

    def named(self, names: Sequence[str]) -> tuple[str, ...] | None:
        """Dimensions of the vectors by their names there or in their column; of the first column that has them."""
        found = {name: name for name in self.assembly.names}
        for source in reversed(self.sources):
            found |= self.assembly.names_of(source)
        return tuple(found[name] for name in names) if set(names) <= set(found) else None

    @property
    def local(self) -> tuple[str, ...]:
        """Names of the dimensions in their columns."""
        return tuple(name for source in self.sources for name in source.names)

    def whole(self, count: int) -> tuple[str, ...]:
        """The dimensions of the first column if there are so many."""
        first = self.sources[0].names if self.sources else ()
        return first if len(first) == count else ()


def _resolved(wiring: Wiring, commanded: _Found, measured: _Found) -> Wiring:
    arm = wiring.build_arm()
    joints = wiring.joints or joints_named_as(arm, commanded.local) or commanded.whole(arm.dof)
    state = _checked(measured, wiring.state_joints, "state")
    if not state and (wiring.state_from or _same_names(commanded, measured)):
        state = measured.named(joints) or measured.named(measured.whole(arm.dof) if wiring.state_from else ()) or ()
    return wiring.replaced(joints=_checked(commanded, joints, "joint vector"), state_joints=state)


def _same_names(commanded: _Found, measured: _Found) -> bool:
    """True if equal names mean the same joint: numbers do so within one column only."""
    columns = {source.column for source in commanded.sources}
    return all(source.named or columns == {source.column} for source in (*commanded.sources, *measured.sources))


def _checked(found: _Found, names: Sequence[str], noun: str) -> tuple[str, ...]:
    resolved = found.named(names)
    if resolved is None:
        unknown = next(name for name in names if found.named((name,)) is None)
        raise UnknownNameError(f"dimension of the {noun}", unknown, found.assembly.names)
    return resolved


def _sources(dataset: Dataset, texts: Sequence[str]) -> tuple[ColumnSource, ...]:
    return tuple(ColumnSource.parse(text, dataset) for text in texts)


def _assembly(of_arms: Sequence[tuple[ColumnSource, ...]]) -> Assembly:
    """What several arms are in, each column once."""
    once = {(each.dataset.root, each.column, each.names): each for sources in of_arms for each in sources}
    assembly = Assembly(tuple(once.values()))
    if len(set(assembly.names)) != len(assembly.names):
        raise DatasetError(f"A dimension is given twice: {', '.join(assembly.names)}.")
    return assembly
