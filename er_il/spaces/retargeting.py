"""Retargeting: the motion of one arm as that of another, by end-effector pose and arm angle.

    p' = S' + s (p - S),    R' = R,    phi' = phi

S and S' are the arms' shoulders (:func:`er_il.kinematics.reach.shoulder`), s the ratio of their reaches unless another
scale is asked for: what one arm does at a share of its reach, the other does at the same share of its own, so that the
edge of the workspace becomes the edge of the workspace. Rotations and the arm angle, which have no length, stay: both
arms' end-effector frames are taken to be mounted alike, and both base frames to have z up and x ahead. The arm angle is
counted from the stereographic reference, which is continuous wherever an arm works.

An arm without a shoulder, an elbow and a wrist has no arm angle; then only the pose is kept, and the elbow stays near
where it was a frame before.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.arm_angle import STEREO, ArmAngle, wrapped
from er_il.kinematics.reach import reach, shoulder
from er_il.kinematics.redundancy import Array
from er_il.kinematics.search import FAR, at_limits
from er_il.kinematics.solver import Status, kinematics_of
from er_il.spaces.deviation import Deviation
from er_il.spaces.pose import TASK, PoseSpace
from er_il.spaces.registry import ERA_STEREO, make_arm_space
from er_il.support.errors import ErIlError

STILL = 1e-9  # [rad] keeps divisions finite
BATCH = 12  # fewer rows are solved sooner one by one
SEEDS = 32  # where else a first frame is looked for, if a path from home misses a frame,
BRANCHES = 3  # and how many of the postures that are found so are followed
APART = 0.1  # [rad] postures nearer to each other are the same


@dataclass(frozen=True, eq=False)
class Retargeting:
    """From one arm to another.

    Raises:
        ErIlError: the scale is not positive.
    """

    source: Arm
    target: Arm
    scale: float  # s [1] of positions about the shoulder

    @classmethod
    def between(cls, source: Arm, target: Arm, scale: float | None = None) -> "Retargeting":
        """With this scale, or the ratio of the arms' reaches."""
        return cls(source, target, reach(target) / reach(source) if scale is None else scale)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.scale) and self.scale > 0):
            raise ErIlError(f"A scale is a positive number, not {self.scale:g}.")

    @cached_property
    def keeps_arm_angle(self) -> bool:
        """True if both arms have an arm angle."""
        return all(arm.angle_frames is not None and arm.redundancy == 1 for arm in (self.source, self.target))

    @cached_property
    def space(self) -> PoseSpace:
        """The space of the goals: the target's pose and, if it is kept, arm angle."""
        space = make_arm_space(ERA_STEREO if self.keeps_arm_angle else TASK, self.target)
        assert isinstance(space, PoseSpace)
        return space

    def goals(self, q: Array) -> Array:
        """What the target is to do (T, dim of :attr:`space`) where the source does q (T, n) [rad], in time order."""
        T_base_ee = kinematics_of(self.source).fk_batch(q)
        p = shoulder(self.target) + self.scale * (T_base_ee[:, :3, 3] - shoulder(self.source))
        parts = [p, self.space.rotation.encode(T_base_ee[:, :3, :3])]
        if self.keeps_arm_angle:
            parts.append(ArmAngle.from_home(self.source, STEREO).along(q))
        return np.column_stack(parts)

    def within(self, fps: float) -> Vector:
        """How far [rad] each joint (n,) may go in a frame: farther is no way for it, but another posture."""
        velocity = self.target.velocity
        return np.maximum(FAR, np.where(np.isfinite(velocity), velocity, 0.0) / fps)

    def follow(
        self, goals: Sequence[Array], fps: float, advance: Callable[[int], object] = lambda frames: None
    ) -> list[Array]:
        """Joint paths (T, n) [rad] of the target through the goals (T, dim) of each episode.

        A frame is solved from the one before, of all episodes at once, the first from home. Where such a path misses
        a frame, those from a few other postures of its first frame are tried, and the one that misses least is taken.

        Args:
            goals: See :meth:`goals`.
            fps: Frames a second [Hz].
            advance: Called with the number of frames done since the last call.
        """
        starts = self.reached(np.stack([each[0] for each in goals]), np.tile(self.target.home, (len(goals), 1)))
        paths = self._walk(goals, starts, fps, advance)
        for episode, asked in enumerate(goals):
            if self._missed(asked, paths[episode]) and (others := self._postures(asked[0], starts[episode])):
                tried = [paths[episode], *self._walk([asked] * len(others), np.array(others), fps)]
                paths[episode] = min(tried, key=lambda path: self._missed(asked, path))
        return paths

    def _missed(self, goals: Array, q: Array) -> int:
        return np.count_nonzero(self.deviation(goals, q).missed)

    def _walk(
        self,
        goals: Sequence[Array],
        starts: Array,
        fps: float,
        advance: Callable[[int], object] = lambda frames: None,
    ) -> list[Array]:
        lengths = np.array([len(each) for each in goals])
        paths = [np.empty((length, self.target.dof)) for length in lengths]
        q, step = starts.copy(), np.zeros_like(starts)
        for t in range(int(lengths.max())):
            going = np.flatnonzero(lengths > t)
            if t:
                asked = np.stack([goals[episode][t] for episode in going])
                found = self.reached(asked, q[going], step[going], self.within(fps))
                step[going], q[going] = found - q[going], found
            for episode in going:
                paths[episode][t] = q[episode]
            advance(len(going))
        return paths

    def _postures(self, goal: Vector, known: Vector) -> list[Vector]:
        """Other postures (n,) [rad] that reach a goal (dim,), those nearest home first."""
        arm = self.target
        shares = np.random.default_rng(0).random((SEEDS, arm.dof))
        found = self.space.decode_batch(np.tile(goal, (SEEDS, 1)), arm.lower + (arm.upper - arm.lower) * shares)
        distinct: list[Vector] = [known]
        for q in sorted(found.q[found.status == Status.OK], key=lambda each: float(np.linalg.norm(each - arm.home))):
            if all(np.abs(q - other).max() > APART for other in distinct):
                distinct.append(q)
        return distinct[1 : BRANCHES + 1]

    def reached(self, goals: Array, before: Array, step: Array | float = 0.0, within: Vector | float = np.inf) -> Array:
        """Joint angles (N, n) [rad] that reach goals, or come as near as they can.

        Where a goal is out of reach, or its solution farther than ``within``, as on the other side of a fold, the elbow
        gives way first: the pose is kept, with the arm angle that is nearest. Where the pose is out of reach, too, it
        is the nearest pose (a local minimum of its error, in metres and radians), whatever the elbow.

        Args:
            goals: (N, dim) of :attr:`space`.
            before: (N, n) [rad] where the arm comes from.
            step: (N, n) [rad] its last step: at a fold, where two solutions meet, the path goes straight on.
            within: (n,) [rad] how far each joint may go.
        """
        seeds = self.target.within_limits(before + step)
        if len(goals) >= BATCH:
            result = self.space.decode_batch(goals, seeds)
            q, exact = result.q, result.status == Status.OK
        else:
            found = [self.space.decode(*each) for each in zip(goals, seeds, strict=True)]
            q, exact = np.array([each.q for each in found]), np.array([each.status is Status.OK for each in found])
        share = np.min(within / np.maximum(np.abs(q - before), STILL), axis=1)  # of the way that may be gone
        for row in np.flatnonzero(~exact | (share < 1.0)):
            posture = before[row] + min(1.0, share[row]) * (q[row] - before[row])
            q[row] = self._nearest(goals[row], before[row], posture)
        return q

    def _nearest(self, goal: Vector, seed: Vector, posture: Vector) -> Vector:
        """Joint angles (n,) [rad] that keep a goal's pose, the elbow pulled to a posture, or come as near as can be."""
        T_base_ee, _ = self.space.split(goal)
        kinematics = kinematics_of(self.target)
        relaxed = kinematics.solve(T_base_ee, seed, posture=posture)
        return relaxed.q if relaxed.status is Status.OK else kinematics.solve(T_base_ee, seed).q

    def deviation(self, goals: Array, q: Array, fps: float = 0.0) -> Deviation:
        """How far a path q (T, n) [rad] of the target is from goals (T, dim), by forward kinematics.

        Args:
            goals: See :meth:`goals`.
            q: The path.
            fps: Frames a second [Hz]; without it, joints have no speed.
        """
        arm, space = self.target, self.space
        T_base_ee = kinematics_of(arm).fk_batch(q)
        code = goals[:, 3 : 3 + len(space.rotation.names)]
        turn = Rotation.from_matrix(T_base_ee[:, :3, :3]).inv() * Rotation.from_quat(code)
        angle = np.zeros(len(q))
        if self.keeps_arm_angle:
            angle = np.abs(wrapped(ArmAngle.from_home(arm, STEREO).wrapped(q) - goals[:, -1]))
        at_lower, at_upper = at_limits(arm, q)
        speed = np.zeros_like(q)
        limited = np.isfinite(arm.velocity) & (arm.velocity > 0)  # a URDF may say none
        speed[1:, limited] = np.abs(np.diff(q[:, limited], axis=0)) * fps / arm.velocity[limited]
        return Deviation(
            np.linalg.norm(T_base_ee[:, :3, 3] - goals[:, :3], axis=1),
            turn.magnitude(),
            angle,
            at_lower | at_upper,
            speed,
        )
