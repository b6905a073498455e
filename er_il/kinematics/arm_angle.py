"""The arm angle (paper IV-B): where the elbow stands on its circle around the shoulder-wrist axis.

    p_E = c_E + r_E (t_E cos phi + b_E sin phi)

The axis a points from the shoulder S to the wrist W. c_E is the elbow's foot on it, t_E points from
there to the highest point of the circle, and b_E = a x t_E; so phi = 0 at the top and phi grows
with a right-handed turn about the axis. High is along the base frame's z. Other choices of t_E, which are
singular elsewhere: :mod:`er_il.kinematics.reference_direction`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from er_il.arms.arm import Arm, Vector
from er_il.kinematics.components import Components, at_least, dot, length, minus, plus, times
from er_il.kinematics.redundancy import Array, Redundancy, Slope
from er_il.kinematics.reference_direction import TINY, ReferenceDirection, Stereographic, Up
from er_il.support.errors import ArmError, SpecError

MARGIN = 0.2  # cosine of the distance from the turn opposite to the reference, within which turns are in doubt
UP, STEREO = Up(), Stereographic()


class ElbowCircle(NamedTuple):
    """The circle on which the elbow can turn while shoulder and wrist stay; all in the base frame.

    Points and directions are their components (x, y, z): numbers, or arrays (N,) for N circles at once.
    """

    shoulder: Components  # [m]
    axis: Components  # unit vector from shoulder to wrist
    reach: Any  # [m] from shoulder to wrist
    foot: Any  # [m] from the shoulder to the circle's centre, along the axis
    radius: Any  # [m] r_E
    top: Components  # t_E, unit
    side: Components  # b_E, unit
    spin: Components  # derivative of the turn of ``top`` about the axis by the axis
    angle: Any  # [rad] phi in (-pi, pi]

    @classmethod
    def through(
        cls,
        shoulder: Components,
        elbow: Components,
        wrist: Components,
        *,
        direction: ReferenceDirection = UP,
        xp: Any = math,
    ) -> "ElbowCircle":
        """The circle of three points [m]; ``xp``: functions for the components' type, ``math`` or an array library."""
        span = minus(wrist, shoulder)
        reach = at_least(TINY, length(span, xp), xp)
        axis = times(1.0 / reach, span)
        top, side, spin = direction.of(axis, xp)
        arm = minus(elbow, shoulder)
        foot = dot(arm, axis)
        spoke = minus(arm, times(foot, axis))
        radius = at_least(TINY, length(spoke, xp), xp)
        angle = xp.atan2(dot(spoke, side), dot(spoke, top))
        return cls(shoulder, axis, reach, foot, radius, top, side, spin, angle)

    def elbow(self, angle: float) -> Array:
        """Elbow position (3,) [m] at an arm angle [rad]: the equation above."""
        spoke = plus(times(math.cos(angle), self.top), times(math.sin(angle), self.side))
        centre = plus(self.shoulder, times(self.foot, self.axis))
        return np.array(plus(centre, times(self.radius, spoke)))

    def slopes(self, xp: Any = math) -> tuple[Components, Components]:
        """Derivatives of r_E phi by the elbow's and by the wrist's position, r_E and the shoulder held.

        Lengths along the circle, not angles: these stay finite where the circle shrinks to a point.
        """
        tangent = minus(times(xp.cos(self.angle), self.side), times(xp.sin(self.angle), self.top))
        # Turning the axis carries the circle's centre along, and turns the reference about the axis.
        turned = plus(times(self.radius, self.spin), times(self.foot, tangent))
        return tangent, times(-1.0 / self.reach, turned)


@dataclass(frozen=True, eq=False)
class ArmAngle(Redundancy):
    """The arm angle of one arm as a function of its joints (ERA).

    Along a trajectory the angle is unwrapped; the first takes the turn nearest to ``reference``.

    Raises:
        ArmError: the arm names no shoulder, elbow and wrist.
    """

    reference: float = 0.0  # [rad]
    direction: ReferenceDirection = UP

    def __post_init__(self) -> None:
        if self.arm.angle_frames is None:
            raise ArmError(
                f"{self.arm.name} names no shoulder, elbow and wrist links, which the arm angle needs: "
                "give angle_frames."
            )

    @classmethod
    def from_home(cls, arm: Arm, direction: ReferenceDirection = UP) -> "ArmAngle":
        """The arm angle counted from the turn of the arm's home posture."""
        angle = cls(arm, direction=direction)
        return replace(angle, reference=float(angle.wrapped(arm.home[None])[0]))

    @property
    def names(self) -> tuple[str, ...]:
        return ("arm_angle",)

    @property
    def frames(self) -> tuple[str, ...]:
        frames = self.arm.angle_frames
        assert frames is not None
        return frames.shoulder, frames.elbow, frames.wrist

    def circle(self, q: Vector) -> ElbowCircle:
        """The elbow's circle at q (n,) [rad]."""
        return ElbowCircle.through(*self._forward.points(q, self.frames).origins, direction=self.direction)

    def wrapped(self, q: Array) -> Vector:
        """Arm angles (N,) [rad] in (-pi, pi] at q (N, n) [rad]."""
        return ElbowCircle.through(*self._forward.positions(q, self.frames), direction=self.direction, xp=np).angle

    def along(self, q: Array) -> Array:
        unwrapped = np.unwrap(np.concatenate([[self.reference], self.wrapped(q)]))[1:]
        return np.asarray(unwrapped, dtype=np.float64)[:, None]

    def slope(self, q: Sequence[Any], points: Sequence[Components], xp: Any = math) -> Slope:
        circle = ElbowCircle.through(*points, direction=self.direction, xp=xp)
        by_elbow, by_wrist = circle.slopes(xp)
        by_shoulder = times(-1.0, plus(by_elbow, by_wrist))
        return Slope((circle.angle,), circle.radius, ((by_shoulder, by_elbow, by_wrist),))

    def difference(self, start: Vector, end: Vector) -> Vector:
        return wrapped(end - start)

    def fitted(self, postures: Array) -> "ArmAngle":
        """Another reference where the arm angles of postures lie about half a turn from this one."""
        angles = self.wrapped(postures)
        if np.cos(angles - self.reference).min() >= MARGIN - 1.0:
            return self
        mean = np.arctan2(np.sin(angles).mean(), np.cos(angles).mean())
        return replace(self, reference=float(np.round(mean, 1)))

    def details(self) -> dict[str, Any]:
        assert self.arm.angle_frames is not None
        frames = asdict(self.arm.angle_frames)
        return {"arm_angle": {**frames, **self.direction.details(), "reference": self.reference}}

    def restored(self, spec: Mapping[str, Any]) -> "ArmAngle":
        described = spec["arm_angle"]
        own = replace(self, reference=float(described["reference"]))
        if own.details()["arm_angle"] != described:
            raise SpecError(
                f"The action spec measures the arm angle by {described}, but {self.arm.name!r} by "
                f"{own.details()['arm_angle']}."
            )
        return own


def wrapped[T: (float, Array)](angle: T) -> T:
    """The representative of an angle [rad] in [-pi, pi), or of each of an array."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi
