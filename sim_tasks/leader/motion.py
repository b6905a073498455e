"""Motion planning: keyframes to collision-checked joint paths with a chosen elbow, then smooth timing."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation, Slerp

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import Status, kinematics_of
from er_il.support.errors import PlanError

STRAIGHT_STEP = 0.02  # [m] spacing of the waypoints on a straight line
CHECK_STEP = 0.05  # [rad] spacing of collision checks
ELBOW_SEARCH = np.linspace(0.0, 0.6, 13)  # [rad] deviations from the desired elbow angle that are tried
GRID = 400  # points at which a path's speed is evaluated


@dataclass(frozen=True)
class Keyframe:
    """A pose of the hand along a path, with the desired elbow."""

    T_base_ee: np.ndarray  # (4, 4)
    elbow: float | None  # [rad] desired angle of the arm's last redundant joint; None: that of the nearest posture
    straight: bool = False  # the hand moves to it on a straight line
    lean: float | None = None  # [rad] as elbow, for the redundant joints below that one, if the arm has any


@dataclass(frozen=True)
class Segment:
    """A motion from rest to rest, of the arm or of the gripper alone."""

    waypoints: np.ndarray  # (K, n) [rad]
    gripper: float  # opening in [0, 1]
    closing: float = 0.0  # [s] duration of the gripper's motion from the opening before
    hold: float = 0.0  # [s] rest at the end, for the gripper to act
    pace: float = 1.0  # share of the script's speed

    def openings(self, before: float, period: float, steps: int) -> np.ndarray:
        """Openings (steps,) of the gripper every ``period`` seconds, from the opening ``before`` the segment."""
        if not self.closing:
            return np.full(steps, self.gripper)
        times = np.arange(1, steps + 1) * period
        return np.interp(times, (0.0, self.closing), (before, self.gripper))

    def sample(self, velocity: Vector, period: float, speed: float) -> np.ndarray:
        """Joint angles (T, n) every ``period`` seconds at a share ``speed`` of the velocity limits (n,) [rad/s]."""
        waypoints = self.waypoints
        still = np.tile(waypoints[-1], (round(self.hold / period), 1))
        if len(waypoints) < 2:
            return still
        knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
        curve = PchipInterpolator(knots / knots[-1], waypoints)
        grid = np.linspace(0, 1, GRID)
        fastest = np.max(np.abs(np.diff(curve(_ease(grid)), axis=0)) * (GRID - 1) / velocity)  # [s] at full speed
        steps = max(2, int(np.ceil(fastest / (speed * self.pace) / period)))
        return np.concatenate([curve(_ease(np.arange(1, steps + 1) / steps)), still])


def _ease(t: np.ndarray) -> np.ndarray:
    """Minimum-jerk progress in [0, 1] at shares t of the time."""
    return t**3 * (10 - 15 * t + 6 * t**2)


def solve_keyframe(arm: Arm, keyframe: Keyframe, seed: Vector, is_free: Callable[[Vector], bool]) -> Vector:
    """Return collision-free joint angles (n,) [rad] at a keyframe, the elbow as near to the desired one as possible.

    Raises:
        PlanError: no elbow within the search range is reachable and free.
    """
    desired = _desired(arm, keyframe, seed)
    elbow = arm.redundant[-1]
    offsets = [sign * offset for offset in ELBOW_SEARCH for sign in (1, -1)]
    for offset in offsets:
        fixed = desired | {elbow: desired[elbow] + offset}
        ik = kinematics_of(arm).solve(keyframe.T_base_ee, seed, *joint_angles(arm, fixed))
        if ik.status is Status.OK and is_free(ik.q):
            return ik.q
    x, y, z = keyframe.T_base_ee[:3, 3]
    raise PlanError(
        f"No collision-free elbow near {desired[elbow]:.2f} rad for the hand at ({x:.2f}, {y:.2f}, {z:.2f})."
    )


def _desired(arm: Arm, keyframe: Keyframe, seed: Vector) -> dict[str, float]:
    """Desired angles [rad] of all redundant joints: the keyframe's where it has one, else the nearest posture's."""
    *below, elbow = arm.redundant
    desired = {} if keyframe.lean is None else dict.fromkeys(below, keyframe.lean)
    if keyframe.elbow is not None:
        desired[elbow] = keyframe.elbow
    if left := [joint for joint in arm.redundant if joint not in desired]:
        nearest = kinematics_of(arm).solve(keyframe.T_base_ee, seed, *joint_angles(arm, desired)).q
        # Free joints differ in the last bits from machine to machine; rounding leads all to the same plan.
        desired |= {joint: round(float(nearest[arm.joints.index(joint)]), 4) for joint in left}
    return desired


def plan_path(arm: Arm, start: Vector, keyframes: Sequence[Keyframe], is_free: Callable[[Vector], bool]) -> np.ndarray:
    """Return waypoints (K, n) [rad] from a start (n,) through keyframes, checked for collision along the path.

    Raises:
        PlanError: a keyframe cannot be reached, or the path to it is blocked.
    """
    waypoints = [np.asarray(start)]
    for keyframe in keyframes:
        goal = solve_keyframe(arm, keyframe, waypoints[-1], is_free)
        waypoints += _straight(arm, waypoints[-1], goal, keyframe) if keyframe.straight else [goal]
    # Solutions of IK differ in the last bits from machine to machine, and servos at their limits would amplify that.
    path = np.array(waypoints).round(12)
    for one, other in pairwise(path):
        for t in np.linspace(0, 1, max(2, int(np.max(np.abs(other - one)) / CHECK_STEP) + 1)):
            if not is_free((1 - t) * one + t * other):
                raise PlanError("The path between two keyframes is blocked.")
    return path


def joint_angles(arm: Arm, angles: Mapping[str, float]) -> tuple[JointAngle, list[float]]:
    """The redundancy and its values that hold joints at angles [rad]."""
    return JointAngle(arm, tuple(angles)), list(angles.values())


def _straight(arm: Arm, start: Vector, goal: Vector, keyframe: Keyframe) -> list[Vector]:
    """Waypoints after the start along a straight line of the hand, the redundant joints turning evenly."""
    kinematics = kinematics_of(arm)
    T_start, T_goal = kinematics.fk(start), keyframe.T_base_ee
    steps = max(1, int(np.ceil(np.linalg.norm(T_goal[:3, 3] - T_start[:3, 3]) / STRAIGHT_STEP)))
    turn = Slerp([0, 1], Rotation.from_matrix([T_start[:3, :3], T_goal[:3, :3]]))
    redundant = {joint: arm.joints.index(joint) for joint in arm.redundant}
    waypoints = [start]
    for t in np.arange(1, steps + 1) / steps:
        T = np.eye(4)
        T[:3, :3] = turn(t).as_matrix()
        T[:3, 3] = (1 - t) * T_start[:3, 3] + t * T_goal[:3, 3]
        angles = {joint: (1 - t) * start[i] + t * goal[i] for joint, i in redundant.items()}
        ik = kinematics.solve(T, waypoints[-1], *joint_angles(arm, angles))
        if ik.status is not Status.OK:
            raise PlanError("The hand cannot follow the straight line to a keyframe.")
        waypoints.append(ik.q)
    return waypoints[1:]
