"""Task space and the ER spaces: an end-effector pose, then the values of a redundancy, if any (paper III-A, IV)."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import array_api_compat as array_api
import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_il.arms.arm import Vector
from er_il.kinematics.batch import BatchGoal
from er_il.kinematics.chain import chunks, constant
from er_il.kinematics.redundancy import Redundancy
from er_il.kinematics.rotation import Quaternion, RotationCode, RotationError
from er_il.kinematics.search import FAR
from er_il.kinematics.solver import IkResult, Kinematics, Status, kinematics_of
from er_il.spaces.base import ArmSpace, Array
from er_il.spaces.round_trip import SINGULAR

POSITION_NAMES = ("ee.x", "ee.y", "ee.z")
TASK = "task"
IDENTITY = np.eye(4)
EASED = (0.5, 0.2, 0.1, 0.0)  # shares of the way to a redundancy value that is too far
SLACK = 1e-2  # [m, of an unscaled value rad] a value so near the present one may wait while it is next to a singularity
POSTURE_PULL = 0.05  # [rad] of the joint farthest from the posture; at 20 Hz, half a Panda's full speed


@dataclass(frozen=True, eq=False)
class PoseSpace(ArmSpace):
    """Position [m] and rotation of the end effector in the base frame, then redundancy values [rad].

    Without a redundancy this is task space, whose action leaves the elbow to IK: ``posture`` None takes the solution
    nearest the seed (minimal displacement), a posture (n,) [rad] one that is nearer to it than the seed, by at most
    ``POSTURE_PULL`` a decode: the null space then moves as a controller on a robot would move it, not by a jump.

    ``damped`` selects the steps of IK (see :mod:`er_il.kinematics.search`); it is no part of what an action means.
    """

    rotation: RotationCode
    er_kind: str = ""  # kind of the ER space; task space if empty
    redundancy: Redundancy | None = None
    posture: Vector | None = None
    damped: bool = field(default=True, kw_only=True)

    @property
    def kind(self) -> str:
        return self.er_kind or TASK

    @property
    def kinematics(self) -> Kinematics:
        return kinematics_of(self.arm, self.damped)

    @property
    def redundancy_names(self) -> tuple[str, ...]:
        """Names of the redundancy values; () in task space."""
        return () if self.redundancy is None else self.redundancy.names

    @property
    def names(self) -> tuple[str, ...]:
        return self._names

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return (*POSITION_NAMES, *self.rotation.names, *self.redundancy_names)

    def redundancy_along(self, q: Array) -> Array:
        """Redundancy values (N, m) along a trajectory q (N, n) [rad]."""
        return np.empty((len(q), 0)) if self.redundancy is None else self.redundancy.along(q)

    def conditioning(self, q: ArrayLike) -> float:
        return self.kinematics.conditioning(q, self.redundancy)

    def conditionings(self, q: Array) -> Vector:
        return self.kinematics.conditionings(q, self.redundancy)

    def solve(self, T_base_ee: Array, values: Vector, seed: Vector) -> IkResult:
        """Find joint angles with a pose (4, 4) and redundancy values (m,), near a seed (n,) [rad]."""
        if self.posture is None:
            return self.kinematics.solve(T_base_ee, seed, self.redundancy, values)
        way = self.posture - seed
        share = min(1.0, POSTURE_PULL / max(float(np.max(np.abs(way))), POSTURE_PULL))
        return self.kinematics.solve(T_base_ee, seed, self.redundancy, values, posture=seed + share * way)

    def steady(self, action: ArrayLike, seed: Vector) -> Vector | None:
        """Meet the pose without self-motion, where the redundancy's values hardly see it.

        Next to a singularity of ERA (on a Panda: the upper arm upright, so that joints 1 and 3 turn it about one axis)
        self-motion leaves the elbow where it is. A value that is off by a hundredth of a radian, as a policy's is, then
        asks for tenths of a radian of self-motion, which delay the hand and take joints to where no demonstration was,
        for millimetres of the elbow. The value is followed again once the arm leaves the singularity, or if it asks for
        more than ``SLACK``. ERJ has no part in this: its joints are held at their values, and nothing else is free.
        """
        redundancy = self.redundancy
        if redundancy is None or redundancy.held:
            return None
        start = self.arm.within_limits(seed)
        T_base_ee, values = self.split(np.asarray(action, dtype=np.float64))
        present = redundancy.linearise(start)
        way = present.scale * redundancy.difference(present.values, values)
        if np.abs(way).max() > SLACK or self.conditioning(start) >= SINGULAR:
            return None
        ik = self.kinematics.solve(T_base_ee, start)
        return ik.q if ik.status is Status.OK else None

    def ease(self, action: ArrayLike, seed: Vector, within: Vector, current: Vector) -> Vector | None:
        return self.ease_pose(*self.split(np.asarray(action, dtype=np.float64)), seed, within)

    def ease_pose(self, T_base_ee: Array, values: Vector, seed: Vector, within: Vector) -> Vector | None:
        """Meet a pose near a seed, and of redundancy values as much as lies on the way.

        Near a singularity of the redundancy (for ERA on a Panda: the upper arm vertical), a value that is off by a
        hundredth of a radian, as a policy's is, belongs to an elbow far away. The pose is met all the same.

        Args:
            T_base_ee: (4, 4) pose.
            values: (m,) redundancy values that decode to joints far from the seed.
            seed: (n,) [rad] the arm's measured angles.
            within: (n,) [rad] how far each joint may be from the seed.

        Returns:
            Joint angles (n,) [rad]; if no redundancy between the seed's and the action's brings them near, those
            nearest the seed with the pose alone. None in task space, which commands no redundancy.
        """
        if self.redundancy is None:
            return None
        start = self.arm.within_limits(seed)
        present = self.redundancy.along(start[None])[0]
        for share in EASED:
            ik = self.solve(T_base_ee, present + share * self.redundancy.difference(present, values), start)
            if ik.status is Status.OK and np.all(np.abs(ik.q - start) <= within):
                return ik.q
        return self.kinematics.solve(T_base_ee, start).q

    def fitted(self, postures: Array) -> Self:
        """The same space with the redundancy's conventions that suit postures (N, n) [rad]."""
        return self if self.redundancy is None else replace(self, redundancy=self.redundancy.fitted(postures))

    def split(self, action: Vector) -> tuple[Array, Vector]:
        """The pose (4, 4) and the redundancy values (m,) of an action (dim,).

        Raises:
            RotationError: its rotation is none.
        """
        split = self._split
        T_base_ee = IDENTITY.copy()
        T_base_ee[:3, 3] = action[:3]
        T_base_ee[:3, :3] = self.rotation.decode(action[3:split])
        return T_base_ee, action[split:]

    @cached_property
    def _split(self) -> int:
        """Number of dimensions of the pose."""
        return len(POSITION_NAMES) + len(self.rotation.names)

    def _encode(self, q: Array) -> Array:
        T_base_ee = self.kinematics.fk_batch(q)
        rotation = self.rotation.encode(T_base_ee[:, :3, :3])
        return np.column_stack([T_base_ee[:, :3, 3], rotation, self.redundancy_along(q)])

    def _decode(self, action: Vector, seed: Vector, current: Vector) -> IkResult:
        try:
            T_base_ee, values = self.split(action)
        except RotationError:
            return IkResult(seed, Status.INVALID)
        return self.solve(T_base_ee, values, seed)

    def _solve_batch(self, actions: Any, seeds: Any) -> tuple[Any, Any]:
        if self.posture is not None:  # two searches, the first with a posture: left to the program
            return super()._solve_batch(actions, seeds)
        xp = array_api.array_namespace(actions)
        finite = xp.all(xp.isfinite(actions), axis=1)
        goal, rotates = self._goals(xp.where(finite[:, None], actions, 0.0), xp)
        lower, upper = constant(self.arm.lower, seeds), constant(self.arm.upper, seeds)
        starts = xp.minimum(xp.maximum(seeds, lower), upper)
        usable = finite & rotates
        held = () if self.redundancy is None else self.redundancy.held
        for joint, value in zip(held, goal.values, strict=False):
            usable = usable & (value >= lower[joint]) & (value <= upper[joint])
            starts[:, joint] = xp.where(usable, value, starts[:, joint])
        q, solved = starts, xp.zeros((len(actions),), dtype=xp.bool, device=array_api.device(actions))
        search, rows = self.kinematics.batch(self.redundancy), xp.nonzero(usable)[0]
        for chunk in chunks(len(rows)):
            some = rows[chunk]
            q[some], solved[some] = search.run(goal.rows(some), starts[some], FAR)
        return q, solved

    def _follow(self, q: Any, actions: Any, status: NDArray[np.str_]) -> Any:
        if not (array_api.is_torch_array(actions) and actions.requires_grad):
            return None
        xp = array_api.array_namespace(actions)
        rows = xp.asarray(np.flatnonzero(status == Status.OK), device=array_api.device(actions))
        goal, _ = self._goals(actions[rows], xp)
        followed = xp.asarray(q, copy=True)
        followed[rows] = self.kinematics.batch(self.redundancy).last_step(goal, q[rows])
        return followed

    def _goals(self, actions: Any, xp: Any) -> tuple[BatchGoal, Any]:
        """The goals of actions (N, dim), and a mask (N,) of those whose rotation is one."""
        rows = actions.T
        R, rotates = self.rotation.decode_batch(rows[3 : self._split], xp)
        return BatchGoal(R, rows[:3], rows[self._split :]), rotates

    def _details(self) -> dict[str, Any]:
        details: dict[str, Any] = {"rotation": self.rotation.kind}
        if isinstance(self.rotation, Quaternion):
            details["hemisphere"] = list(self.rotation.reference)
        return details | ({} if self.redundancy is None else self.redundancy.details())
