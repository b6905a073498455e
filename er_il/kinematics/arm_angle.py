"""The arm angle (paper IV-B): where the elbow stands on its circle around the shoulder-wrist axis.

    p_E = c_E + r_E (t_E cos phi + b_E sin phi)

The axis a points from the shoulder S to the wrist W. c_E is the elbow's foot on it, t_E points from
there to the highest point of the circle, and b_E = a x t_E; so phi = 0 at the top and phi grows
with a right-handed turn about the axis. High is along the base frame's z.

Where the axis is vertical, no point of the circle is the highest and phi has no meaning. Within
``VERTICAL`` of it phi is counted from the base frame's x instead, which keeps it finite; it jumps
on the way in and out, so an arm should not work there.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.forward import ForwardKinematics, forward_of
from er_il.kinematics.redundancy import Array, Linearisation, Redundancy
from er_il.support.errors import ArmError, SpecError

VERTICAL = 1e-3  # [rad] closer than this to the vertical, the axis counts as vertical
MARGIN = 0.2  # cosine of the distance from the turn opposite to the reference, within which turns are in doubt
TINY = 1e-9  # [m] a circle smaller than this is a point
UP = np.array([0.0, 0.0, 1.0])
FORWARD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class ElbowCircle:
    """The circle on which the elbow can turn while shoulder and wrist stay; all in the base frame."""

    axis: Array  # (3,) unit vector from shoulder to wrist
    reach: float  # [m] from shoulder to wrist
    foot: float  # [m] from the shoulder to the circle's centre, along the axis
    radius: float  # [m] r_E
    centre: Array  # (3,) [m] c_E
    top: Array  # (3,) t_E, unit
    side: Array  # (3,) b_E, unit
    vertical: Array  # (3,) what ``top`` is the projection of: up, or forward where the axis is vertical
    angle: float  # [rad] phi in (-pi, pi]

    @classmethod
    def through(cls, shoulder: Array, elbow: Array, wrist: Array) -> "ElbowCircle":
        """The circle of three points (3,) [m]."""
        span = wrist - shoulder
        reach = max(_length(span), TINY)
        axis = span / reach
        vertical = UP if math.hypot(axis[0], axis[1]) > VERTICAL else FORWARD
        projected = vertical - (vertical @ axis) * axis
        top = projected / _length(projected)
        side = _cross(axis, top)
        arm = elbow - shoulder
        foot = float(arm @ axis)
        spoke = arm - foot * axis
        return cls(
            axis=axis,
            reach=reach,
            foot=foot,
            radius=max(_length(spoke), TINY),
            centre=shoulder + foot * axis,
            top=top,
            side=side,
            vertical=vertical,
            angle=math.atan2(float(spoke @ side), float(spoke @ top)),
        )

    def elbow(self, angle: float) -> Array:
        """Elbow position (3,) [m] at an arm angle [rad]: the equation above."""
        return self.centre + self.radius * (self.top * math.cos(angle) + self.side * math.sin(angle))

    def slopes(self) -> tuple[Array, Array]:
        """Derivatives (3,) of r_E phi by the elbow's and by the wrist's position, r_E and the shoulder held.

        Lengths along the circle, not angles: these stay finite where the circle shrinks to a point.
        """
        tangent = self.side * math.cos(self.angle) - self.top * math.sin(self.angle)
        # Turning the axis carries the circle's centre along, and turns the highest point about the axis.
        rise = float(self.vertical @ self.axis)
        twist = self.radius * rise / math.sqrt(max(1.0 - rise * rise, TINY))
        return tangent, (twist * self.side - self.foot * tangent) / self.reach


@dataclass(frozen=True, eq=False)
class ArmAngle(Redundancy):
    """The arm angle of one arm as a function of its joints (ERA).

    Along a trajectory the angle is unwrapped; the first takes the turn nearest to ``reference``.

    Raises:
        ArmError: the arm names no shoulder, elbow and wrist.
    """

    reference: float = 0.0  # [rad]

    def __post_init__(self) -> None:
        if self.arm.angle_frames is None:
            raise ArmError(
                f"{self.arm.name} names no shoulder, elbow and wrist links, which the arm angle needs: "
                "give angle_frames."
            )

    @classmethod
    def from_home(cls, arm: Arm) -> "ArmAngle":
        """The arm angle counted from the turn of the arm's home posture."""
        return cls(arm, float(cls(arm).wrapped(arm.home[None])[0]))

    @property
    def names(self) -> tuple[str, ...]:
        return ("arm_angle",)

    @cached_property
    def _forward(self) -> ForwardKinematics:
        return forward_of(self.arm)

    @cached_property
    def _frames(self) -> tuple[str, str, str]:
        frames = self.arm.angle_frames
        assert frames is not None
        return frames.shoulder, frames.elbow, frames.wrist

    def circle(self, q: Vector) -> ElbowCircle:
        """The elbow's circle at q (n,) [rad]."""
        return ElbowCircle.through(*self._forward.points(q, self._frames)[0])

    def wrapped(self, q: Array) -> Vector:
        """Arm angles (N,) [rad] in (-pi, pi] at q (N, n) [rad]."""
        points = [self._forward.fk_batch(q, frame)[:, :3, 3] for frame in self._frames]
        return np.array([ElbowCircle.through(*point).angle for point in zip(*points, strict=True)])

    def along(self, q: Array) -> Array:
        unwrapped = np.unwrap(np.concatenate([[self.reference], self.wrapped(q)]))[1:]
        return np.asarray(unwrapped, dtype=np.float64)[:, None]

    def linearise(self, q: Vector) -> Linearisation:
        points, by_joints = self._forward.points(q, self._frames)
        circle = ElbowCircle.through(*points)
        by_elbow, by_wrist = circle.slopes()
        shoulder, elbow, wrist = by_joints
        derivative = by_elbow @ (elbow - shoulder) + by_wrist @ (wrist - shoulder)
        return Linearisation(np.array([circle.angle]), circle.radius, derivative[None])

    def difference(self, start: Vector, end: Vector) -> Vector:
        return np.array([wrapped(turn) for turn in end - start])

    def fitted(self, postures: Array) -> "ArmAngle":
        """Another reference where the arm angles of postures lie about half a turn from this one."""
        angles = self.wrapped(postures)
        if np.cos(angles - self.reference).min() >= MARGIN - 1.0:
            return self
        mean = np.arctan2(np.sin(angles).mean(), np.cos(angles).mean())
        return replace(self, reference=float(np.round(mean, 1)))

    def details(self) -> dict[str, Any]:
        assert self.arm.angle_frames is not None
        return {"arm_angle": {**asdict(self.arm.angle_frames), "reference": self.reference}}

    def restored(self, spec: Mapping[str, Any]) -> "ArmAngle":
        described = spec["arm_angle"]
        own = replace(self, reference=float(described["reference"]))
        if own.details()["arm_angle"] != described:
            raise SpecError(
                f"The action spec measures the arm angle by {described}, but {self.arm.name!r} by "
                f"{own.details()['arm_angle']}."
            )
        return own


def wrapped(angle: float) -> float:
    """The representative of an angle [rad] in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def _length(v: Vector) -> float:
    return math.sqrt(v @ v)


def _cross(a: Vector, b: Vector) -> Vector:
    # numpy.cross takes ten times as long for a single pair of vectors, and this runs at every step of IK.
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
