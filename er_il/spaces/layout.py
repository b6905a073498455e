"""Layout: which dimensions of a robot's joint vector move which arm, and what the encoded vector looks like.

One vector may hold several arms, their joints in any order, and anything else (grippers, a lift, a
base). Encoded, it holds each arm's commands, one arm after the other, then everything else as it was.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Arm, Weights
from er_il.arms.portable import arm_from_spec, arm_spec
from er_il.kinematics.solver import BatchResult, IkResult
from er_il.spaces.base import ArmSpace
from er_il.spaces.chunk import CHUNK, RELATIVE, chunk_of, commands_of
from er_il.spaces.joint import JOINT, JointSpace
from er_il.spaces.motors import Motors
from er_il.spaces.references import fitted
from er_il.spaces.registry import arm_space_from_spec, make_arm_space
from er_il.spaces.spec import SPEC_VERSION
from er_il.spaces.spec_types import check_types
from er_il.support.errors import DatasetError, ShapeError, SpecError

Array = NDArray[np.float64]
GRIPPER = "gripper"  # name of the opening in what er_il records


@dataclass(frozen=True, eq=False)
class Part:
    """One arm of a robot."""

    label: str  # "" if there is only one
    space: ArmSpace
    motors: Motors

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the dimensions of the encoded vector that command the arm."""
        return tuple(f"{self.label}_{name}" if self.label else name for name in self.space.names)


@dataclass(frozen=True)
class LayoutDecoded:
    """A joint vector, and what became of each arm's command."""

    vector: Array  # (D,) the robot's values
    parts: tuple[IkResult, ...]


@dataclass(frozen=True, eq=False)
class Layout:
    """The arms in a joint vector of D named dimensions.

    In joint space the encoded vector is the joint vector itself: the robot's names, order and units.

    Chunk-relative actions (:mod:`er_il.spaces.relative`) are encoded as the others. That policies see chunks of
    ``chunk`` of them relative to the state changes the layout's kind alone: ``rel_erj`` for ``erj``.

    Raises:
        DatasetError: arms share a dimension or a label, or use one that is not there.
    """

    names: tuple[str, ...]  # of the joint vector
    parts: tuple[Part, ...]
    chunk: int = 0  # number of actions that policies see relative to one state; 0: absolute ones

    def __post_init__(self) -> None:
        used = [joint for part in self.parts for joint in part.motors.joints]
        if missing := [joint for joint in used if joint not in self.names]:
            raise DatasetError(f"No dimension is named {', '.join(missing)}. Valid: {', '.join(self.names)}.")
        if twice := sorted({joint for joint in used if used.count(joint) > 1}):
            raise DatasetError(f"A dimension can move one joint only: {', '.join(twice)}.")
        if len({part.label for part in self.parts}) != len(self.parts):
            raise DatasetError("Several arms need labels that differ.")
        for part in self.parts:
            if len(part.motors.joints) != part.space.arm.dof:
                raise DatasetError(
                    f"{part.space.arm.name} has {part.space.arm.dof} joints ({', '.join(part.space.arm.joints)}), "
                    f"but {len(part.motors.joints)} dimensions are given: {', '.join(part.motors.joints)}."
                )
        if len(set(self.encoded_names)) != len(self.encoded_names):
            raise DatasetError(f"Encoded, two dimensions would have one name: {', '.join(self.encoded_names)}.")

    @classmethod
    def of_space(cls, space: ArmSpace) -> "Layout":
        """One arm, its joints [rad] in order, then the gripper: what er_il records."""
        return cls.of_spaces({"": space})

    @classmethod
    def of_spaces(cls, spaces: Mapping[str, ArmSpace], chunk: int = 0) -> "Layout":
        """Several arms by their labels, each one's joints [rad] in order, then its gripper: what er_il records."""
        names: list[str] = []
        parts = []
        for label, space in spaces.items():
            joints = JointSpace(space.arm).names
            names += [*joints, f"{label}_{GRIPPER}" if label else GRIPPER]
            parts.append(Part(label, space, Motors(joints, state=joints)))
        return cls(tuple(names), tuple(parts), chunk)

    @property
    def kind(self) -> str:
        """Kind of action space, the same for all arms."""
        return RELATIVE * bool(self.chunk) + self.commands

    @property
    def commands(self) -> str:
        """Kind of action space that decodes: that of the encoded vectors themselves, however policies see them."""
        return self.parts[0].space.kind

    @cached_property
    def other_dimensions(self) -> tuple[str, ...]:
        """Names of the dimensions that belong to no arm, such as grippers; encoding leaves them as they are."""
        used = {joint for part in self.parts for joint in part.motors.joints}
        return tuple(name for name in self.names if name not in used)

    @cached_property
    def other_indices(self) -> list[int]:
        """Positions of :attr:`other_dimensions` in the joint vector."""
        return [self.names.index(name) for name in self.other_dimensions]

    @cached_property
    def encoded_names(self) -> tuple[str, ...]:
        """Names of the dimensions of the encoded vector."""
        if self._joints:
            return self.names
        return (*(name for part in self.parts for name in part.names), *self.other_dimensions)

    @cached_property
    def _joints(self) -> bool:
        return self.commands == JOINT

    def indices(self, part: Part) -> NDArray[np.int_]:
        """Positions of an arm's joints in the joint vector."""
        return self._indices[part.label]

    @cached_property
    def _indices(self) -> dict[str, NDArray[np.int_]]:
        return {part.label: np.array([self.names.index(j) for j in part.motors.joints]) for part in self.parts}

    def angles(self, part: Part, vectors: ArrayLike) -> Array:
        """Angles (..., n) [rad] of an arm in joint vectors (..., D)."""
        return part.motors.angles(np.asarray(vectors)[..., self.indices(part)])

    @property
    def arms(self) -> dict[str, Arm]:
        """The arms by their labels."""
        return {part.label: part.space.arm for part in self.parts}

    def in_space(
        self, kind: str, rotation: str, weights: Mapping[str, Weights] = MappingProxyType({}), chunk: int = CHUNK
    ) -> "Layout":
        """The same layout in another action space (see :func:`er_il.spaces.registry.make_arm_space`).

        Args:
            kind: Name of the space.
            rotation: ``quat``, ``rot6d`` or ``rot6d_rows``.
            weights: Of ERX's coordinates, by the arm's label; those of the arms where it says nothing.
            chunk: Number of actions of a chunk, in a chunk-relative space.
        """
        arms = self.arms | {label: self.arms[label].weighing(rows) for label, rows in weights.items()}
        spaces = {label: make_arm_space(kind, arm, rotation=rotation) for label, arm in arms.items()}
        parts = tuple(replace(part, space=spaces[part.label]) for part in self.parts)
        return replace(self, parts=parts, chunk=chunk_of(kind, chunk))

    def split(self, vector: Array) -> tuple[list[Array], Array]:
        """Split joint vectors (..., D) into each arm's angles (..., n) [rad] and the other dimensions (..., k)."""
        return [self.angles(part, vector) for part in self.parts], vector[..., self.other_indices]

    def join(self, angles: Sequence[Array], others: Array) -> Array:
        """The joint vectors (..., D) that :meth:`split` takes apart."""
        vector = np.empty((*others.shape[:-1], len(self.names)))
        vector[..., self.other_indices] = others
        for part, q in zip(self.parts, angles, strict=True):
            vector[..., self.indices(part)] = part.motors.values(q)
        return vector

    def split_encoded(self, encoded: Array) -> tuple[list[Array], Array]:
        """Split encoded vectors (..., E) into each arm's action (..., dim) and the other dimensions (..., k)."""
        if self._joints:
            return self.split(encoded)
        ends = list(accumulate((len(part.names) for part in self.parts), initial=0))
        return [encoded[..., start:end] for start, end in pairwise(ends)], encoded[..., ends[-1] :]

    def join_encoded(self, actions: Sequence[Array], others: Array) -> Array:
        """The encoded vectors (..., E) that :meth:`split_encoded` takes apart."""
        return self.join(actions, others) if self._joints else np.concatenate([*actions, others], axis=-1)

    def encode(self, vectors: ArrayLike) -> Array:
        """Encode joint vectors (T, D) of one episode in time order, as (T, len(encoded_names))."""
        batch = np.asarray(vectors, dtype=np.float64)
        if batch.ndim != 2 or batch.shape[1] != len(self.names):
            raise ShapeError("Joint vectors", batch.shape, f"(T, {len(self.names)})")
        if self._joints:
            return batch
        angles, others = self.split(batch)
        return self.join_encoded([part.space.encode(q) for part, q in zip(self.parts, angles, strict=True)], others)

    def decode(self, action: ArrayLike, seed: ArrayLike, current: ArrayLike | None = None) -> LayoutDecoded:
        """Decode one encoded vector to a joint vector near a seed.

        Args:
            action: (len(encoded_names),).
            seed: (D,) measured values; those of dimensions that belong to no arm are not read.
            current: (D,) the last command, which a delta counts from; the seed if omitted.
        """
        command, start = np.asarray(action, dtype=np.float64), np.asarray(seed, dtype=np.float64)
        if command.shape != (len(self.encoded_names),):
            raise ShapeError("An encoded vector", command.shape, f"({len(self.encoded_names)},)")
        last = start if current is None else np.asarray(current, dtype=np.float64)
        actions, others = self.split_encoded(command)
        seeds, lasts = self.split(start)[0], self.split(last)[0]
        decoded = tuple(part.space.decode(*each) for part, *each in zip(self.parts, actions, seeds, lasts, strict=True))
        return LayoutDecoded(self.join([each.q for each in decoded], others), decoded)

    def decode_batch(self, actions: Array, seeds: Array, currents: Array) -> tuple[Array, list[BatchResult]]:
        """Decode many encoded vectors to joint vectors; see :meth:`er_il.spaces.base.ArmSpace.decode_batch`.

        Args:
            actions: (N, len(encoded_names)).
            seeds: (N, D) measured values; those of dimensions that belong to no arm are not read.
            currents: (N, D) the last commands.

        Returns:
            Joint vectors (N, D), and the result of each arm.
        """
        own, others = self.split_encoded(actions)
        of_arms = zip(self.parts, own, self.split(seeds)[0], self.split(currents)[0], strict=True)
        results = [part.space.decode_batch(*each) for part, *each in of_arms]
        return self.join([result.q for result in results], others), results

    def fitted(self, vectors: ArrayLike) -> "Layout":
        """The same layout with the references (see :mod:`er_il.spaces.references`) that suit joint vectors (N, D)."""
        parts = (replace(part, space=fitted(part.space, self.angles(part, vectors))) for part in self.parts)
        return replace(self, parts=tuple(parts))

    def spec(self) -> dict[str, Any]:
        """Describe the layout as JSON, to travel with datasets.

        What er_il records itself is described by its action space alone.
        """
        specs = []
        for part in self.parts:
            space = part.space.spec()
            names = [*part.space.names, GRIPPER]  # version 1 names a gripper with each arm, also where there is none
            specs.append(space | {"arm": space["arm"] | arm_spec(part.space.arm), "names": names})
        first = self.parts[0]
        relative = {"space": self.kind, "chunk": self.chunk} if self.chunk else {}
        if not first.label and first.motors.plain and self.names == self.of_space(first.space).names:
            return specs[0] | relative
        arms = [
            {"label": part.label, "motors": part.motors.spec(), **spec}
            for part, spec in zip(self.parts, specs, strict=True)
        ]
        return {
            "version": SPEC_VERSION,
            "space": self.kind,
            "names": list(self.encoded_names),
            "joint_names": list(self.names),
            "arms": arms,
            **relative,
        }

    @classmethod
    def from_spec(cls, spec: Mapping[str, Any]) -> "Layout":
        """Rebuild the layout that :meth:`spec` described.

        Raises:
            SpecError: the specification is of another version, incomplete, or does not fit its arm.
        """
        check_types(spec)
        try:
            if "arms" not in spec:
                space = arm_space_from_spec(spec, arm_from_spec(spec["arm"]))
                return cls.of_spaces({"": space}, _chunk_from_spec(spec))
            parts = tuple(map(_part_from_spec, spec["arms"]))
            return cls(tuple(spec["joint_names"]), parts, _chunk_from_spec(spec))
        except (KeyError, TypeError) as error:
            raise SpecError(f"The action spec is incomplete or damaged ({error}).") from error


def _chunk_from_spec(spec: Mapping[str, Any]) -> int:
    return spec["chunk"] if commands_of(spec["space"]) != spec["space"] else 0


def _part_from_spec(spec: Mapping[str, Any]) -> Part:
    space = arm_space_from_spec(spec, arm_from_spec(spec["arm"]))
    return Part(spec["label"], space, Motors.from_spec(spec["motors"]))
