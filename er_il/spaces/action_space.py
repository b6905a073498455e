"""The action space of an arm and its gripper: the one that users make."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.rotation import Quaternion
from er_il.kinematics.solver import IkResult, Kinematics
from er_il.spaces.base import ArmSpace, Array, checked_action
from er_il.spaces.delta import DeltaBounds
from er_il.spaces.layout import Layout
from er_il.spaces.registry import arm_space_from_spec, make_arm_space


@dataclass(frozen=True)
class Decoded(IkResult):
    """A joint command, and what became of the action it came from."""

    gripper: float = 1.0  # in [0, 1], 1 open


@dataclass(frozen=True, eq=False)
class ActionSpace:
    """An arm's action space and, as the last dimension, its gripper's opening in [0, 1]."""

    arm_space: ArmSpace

    @cached_property
    def layout(self) -> Layout:
        """The joint vector [n joint angles, opening], and how it is encoded."""
        return Layout.of_space(self.arm_space)

    @property
    def arm(self) -> Arm:
        """The arm that it commands."""
        return self.arm_space.arm

    @property
    def kind(self) -> str:
        """Name of the space in a specification, such as ``erj``."""
        return self.arm_space.kind

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each dimension of an action."""
        return self.layout.encoded_names

    @property
    def dim(self) -> int:
        """Length of an action."""
        return len(self.names)

    @property
    def kinematics(self) -> Kinematics:
        """The arm's kinematics in this process."""
        return self.arm_space.kinematics

    def fk(self, q: ArrayLike) -> Array:
        """End-effector pose ``T_base_ee`` (4, 4) at q (n,) [rad]."""
        return self.arm_space.fk(q)

    def encode(self, q: ArrayLike, gripper: ArrayLike = 1.0, start: ArrayLike | None = None) -> Array:
        """Encode joint angles and gripper openings as actions.

        Args:
            q: (n,) [rad], or a trajectory (N, n) in time order: rotations are kept continuous along it.
            gripper: Opening in [0, 1], one value or (N,).
            start: (n,) [rad] command before the first, which a delta counts from; the first itself if omitted.

        Returns:
            (dim,) or (N, dim).

        Raises:
            BoundsError: a delta is larger than its bounds, so that its decoding would not lead there.
        """
        commands = self.arm_space.encode(q, start)
        opening = np.broadcast_to(np.asarray(gripper, dtype=np.float64), commands.shape[:-1])
        return self.layout.join_encoded([commands], opening[..., None])

    def decode(self, action: ArrayLike, seed: ArrayLike, current: ArrayLike | None = None) -> Decoded:
        """Decode an action to joint angles near a seed, and the gripper's opening.

        Args:
            action: (dim,) as a policy gives it; rotations are normalised, the gripper is clipped.
            seed: (n,) [rad] the arm's measured angles, where IK starts.
            current: (n,) [rad] the last command, which a delta counts from; the seed if omitted.
                Absolute spaces do not need it.
        """
        (own,), (opening,) = self.layout.split_encoded(checked_action(action, self.kind, self.names))
        if not np.isfinite(opening):  # a number that is none makes the whole action mean nothing
            own, opening = np.full(len(own), np.nan), 1.0
        ik = self.arm_space.decode(own, seed, current)
        return Decoded(ik.q, ik.status, ik.pos_err, ik.rot_err, ik.iters, float(np.clip(opening, 0.0, 1.0)))

    def spec(self) -> dict[str, Any]:
        """Describe the space as JSON, to travel with datasets (see :func:`from_spec`)."""
        return self.arm_space.spec() | {"names": list(self.names)}


def make_action_space(
    name: str,
    arm: Arm,
    *,
    rotation: str = Quaternion.kind,
    posture: Vector | None = None,
    bounds: DeltaBounds | None = None,
) -> ActionSpace:
    """Build the action space of an arm and its gripper by name; see :func:`er_il.spaces.registry.make_arm_space`."""
    return ActionSpace(make_arm_space(name, arm, rotation=rotation, posture=posture, bounds=bounds))


def from_spec(spec: Mapping[str, Any], arm: Arm | None = None, *, posture: Vector | None = None) -> ActionSpace:
    """Rebuild the space that :meth:`er_il.spaces.action_space.ActionSpace.spec` described.

    See :func:`er_il.spaces.registry.arm_space_from_spec`.
    """
    return ActionSpace(arm_space_from_spec(spec, arm, posture=posture))
