"""Recorded end-effector poses against forward kinematics: convention, frames, residual, and what explains it."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.arms.presets import PRESETS
from er_il.datasets.pose_columns import PoseColumn
from er_il.datasets.sanity_checks import Cause
from er_il.kinematics.forward import forward_of
from er_il.kinematics.frame_fit import LENGTH, SIMPLER, SLACK, FrameFit, fit_frames, inverse
from er_il.kinematics.pose_codes import CODES, PoseCode
from er_il.spaces.motors import UNITS, Motors
from er_il.support.series import percentiles

Array = NDArray[np.float64]

FITTED, TRIED, REPORTED = 300, 60, 5000  # frames that frames are fitted to, that mistakes are tried on, and reported
AGREES = 0.01, np.deg2rad(2.0)  # [m], [rad] 90 % of the measured poses are no farther from those of measured joints
FOLLOWS = 0.04, np.deg2rad(6.0)  # the same of commanded joints, which the arm follows later
SAME = 2e-3, np.deg2rad(0.5)  # [m], [rad] frames that are called the same
CLEAR = 3e-3  # [m] a mistake that leaves less than this explains the poses: no other one is tried
ZEROS = (90.0, -90.0, 180.0)  # [deg] by which a joint's zero is tried elsewhere
PERCENTILES = (50, 90, 99, 100)


@dataclass(frozen=True, eq=False)
class JointValues:
    """Values of one arm's motors, one after the other frame: measured, or commanded."""

    arm: Arm
    motors: Motors
    values: Array  # (N, n) in the order and the units of the motors
    measured: bool

    @property
    def tolerance(self) -> tuple[float, float]:
        """[m], [rad] within which 90 % of the poses must be."""
        return AGREES if self.measured else FOLLOWS


@dataclass(frozen=True, eq=False)
class PoseCheck:
    """What comparing the poses of one arm has found."""

    place: PoseColumn
    code: PoseCode
    joints: JointValues
    fit: FrameFit
    distance: Vector  # (N,) [m]
    angle: Vector  # (N,) [rad]
    cause: str = ""  # a mistake that explains poses that do not agree
    untold: tuple[str, ...] = ()  # joints that could as well turn the other way: they moved too little

    @cached_property
    def agrees(self) -> bool:
        """True if the poses are those of the joints."""
        distance, angle = self.joints.tolerance
        return bool(np.percentile(self.distance, 90) <= distance and np.percentile(self.angle, 90) <= angle)

    @property
    def certain(self) -> bool:
        """True if poses that do not agree are a mistake, rather than of something else."""
        return not self.agrees and (bool(self.cause) or self.place.named)

    def report(self) -> dict[str, Any]:
        """Everything as JSON."""
        T_recorded_base, T_ee_recorded = self.fit.T_recorded_base, self.fit.T_ee_recorded
        kinematics = forward_of(self.joints.arm)
        return {
            "column": self.place.column,
            "dimensions": list(self.place.names[: self.code.width]),
            "convention": self.code.name,
            "joints": "measured" if self.joints.measured else "commanded",
            "agrees": self.agrees,
            "base_frame": _same(inverse(T_recorded_base), kinematics.rigid_to(self.joints.arm.base_frame)),
            "ee_frame": _same(T_ee_recorded, kinematics.rigid_to(self.joints.arm.ee_frame)),
            "urdf_ee_frame": self.joints.arm.ee_frame,
            "urdf_base_frame": self.joints.arm.base_frame,
            "T_recorded_base": T_recorded_base.tolist(),
            "T_ee_recorded": T_ee_recorded.tolist(),
            "undetermined": self.fit.undetermined,
            "position_mm": percentiles(1e3 * self.distance, PERCENTILES),
            "rotation_deg": percentiles(np.rad2deg(self.angle), PERCENTILES),
            "joint_names": list(self.joints.motors.joints),
            "untold": list(self.untold),
            "cause": self.cause,
        }

    def finding(self) -> str:
        """What is wrong, in a sentence or two; "" if the poses agree."""
        if self.agrees:
            return ""
        distance, angle = 1e3 * np.percentile(self.distance, 90), np.rad2deg(np.percentile(self.angle, 90))
        said = (
            f"The poses in {self.place.label} are not those of {self.joints.arm.name}'s joints: whatever constant "
            f"frames lie between them, 10 % are off by more than {distance:.0f} mm or {angle:.0f} degrees."
        )
        if self.cause:
            return f"{said} They agree with {self.cause}."
        return f"{said} No single mistake explains it: an order, a sign, units, or another preset."


def check_poses(
    places: Sequence[PoseColumn], joints: Sequence[JointValues], others: Mapping[str, Array] = {}
) -> PoseCheck | None:
    """Compare the poses of an arm with its joints; None if nothing looks like poses of it.

    Args:
        places: Where the poses may be.
        joints: The arm's joints as commanded, then as measured, as far as they are known.
        others: Joint values (N, n) of other arms by their labels, which may have been mixed up.
    """
    if not places or not joints:
        return None
    rows = _rows(len(joints[0].values), REPORTED)
    places = [replace(each, values=each.values[rows]) for each in places]
    joints = [replace(each, values=each.values[rows]) for each in joints]
    others = {label: values[rows] for label, values in others.items()}
    told = _tried([each for each in places if each.told], joints)
    best = _best(told)
    if best is None or not best.agrees:  # somewhere else, where names say nothing: only poses that agree count
        hidden = _best(_tried([each for each in places if not each.told], joints[-1:]))
        if hidden is not None and hidden.agrees:
            best = hidden
        elif best is not None:
            best = _explained(best, [each for each in told if each.joints is best.joints], others)
    if best is None:
        return None
    final = _compared(best.place, best.code, best.joints, rows=FITTED, refine=True)
    assert final is not None
    return replace(final, cause=best.cause, untold=_untold(final) if final.agrees else ())


def _tried(places: Sequence[PoseColumn], joints: Sequence[JointValues]) -> list[PoseCheck]:
    """All that can be read as poses."""
    found = (_compared(*each, rows=TRIED) for each in itertools.product(places, CODES, joints))
    return [each for each in found if each is not None]


def _best(tried: Sequence[PoseCheck]) -> PoseCheck | None:
    """The first of those that leave about as little as any, as a share of what they may."""
    if not tried:
        return None
    sizes = [_size(each) / each.joints.tolerance[0] for each in tried]
    most = SIMPLER * min(sizes) + SLACK / AGREES[0]
    return next(each for each, size in zip(tried, sizes, strict=True) if size <= most)


def _compared(
    place: PoseColumn,
    code: PoseCode,
    joints: JointValues,
    rows: int,
    *,
    cause: Cause | None = None,
    refine: bool = False,
) -> PoseCheck | None:
    """The best constant frames between the poses of a code and those of joints, or of what a cause makes of them."""
    width = len(place.names)
    if width < code.width or (place.exact and width != code.width):
        return None
    spread = slice(None) if refine else _rows(len(place.values), rows)
    B = code.decode(place.values[spread, : code.width].astype(np.float64))
    if B is None:
        return None
    arm = cause.arm if cause else joints.arm
    q = cause.q[spread] if cause else joints.motors.angles(joints.values[spread])
    sound = np.isfinite(B).all(axis=(1, 2)) & np.isfinite(q).all(axis=1)
    if not sound.any():
        return None
    kinematics = forward_of(arm)
    A, B = kinematics.fk_batch(q[sound]), B[sound]
    few = _rows(len(A), rows)
    bases = {name: inverse(T) for name, T in kinematics.rigid_to(arm.base_frame).items()}
    ees = kinematics.rigid_to(arm.ee_frame)
    if not refine:  # other frames leave as little where both are fitted
        bases, ees = ({name: frames[name]} for name, frames in ((arm.base_frame, bases), (arm.ee_frame, ees)))
    fit = fit_frames(A[few], B[few], bases, ees, refine)
    return PoseCheck(place, code, joints, fit, *fit.residuals(A, B), cause=cause.text if cause else "")


def _explained(best: PoseCheck, told: Sequence[PoseCheck], others: Mapping[str, Array]) -> PoseCheck:
    """The same with the mistake that explains it best, if one does."""
    explained = best
    for cause in _mistakes(best.joints, others):
        tried = [_compared(each.place, each.code, best.joints, TRIED, cause=cause) for each in told]
        explained = min([explained, *(each for each in tried if each is not None)], key=_size)
        if _size(explained) <= CLEAR:
            break
    return explained if explained.agrees else best


def _mistakes(joints: JointValues, others: Mapping[str, Array]) -> Iterator[Cause]:
    """All single mistakes in the description of an arm."""
    arm, motors, values = joints.arm, joints.motors, joints.values
    q = motors.angles(values)
    for units in UNITS:
        if units != motors.units:
            long = "degrees" if units == "deg" else "radians"
            yield Cause(f"joints in {long} (--units {units})", arm, replace(motors, units=units).angles(values))
    for label, other in others.items():
        if other.shape == values.shape:
            yield Cause(f"the joints of {label}: the arms are mixed up", arm, motors.angles(other))
    signs = np.array(motors.signs or np.ones(arm.dof))
    for i, name in enumerate(motors.joints):
        turned = signs * np.where(np.arange(arm.dof) == i, -1, 1)
        text = f"{name} turning the other way (--signs {' '.join(f'{sign:g}' for sign in turned)})"
        yield Cause(text, arm, replace(motors, signs=tuple(turned)).angles(values))
    for order in _orders(arm.dof):
        names = " ".join(motors.joints[i] for i in order)
        yield Cause(f"another order of the joints (--joints {names})", arm, q[:, order])
    for name in PRESETS:
        other = Arm.preset(name)
        if name != arm.name and other.dof == arm.dof:
            yield Cause(f"another arm, {name} (--arm {name})", other, q)
    for i, turn in itertools.product(range(1, arm.dof - 1), ZEROS):  # the first and the last are part of the frames
        moved = q + np.deg2rad(turn) * np.eye(arm.dof)[i]
        yield Cause(f"{motors.joints[i]} counted from {turn:g} degrees elsewhere (--offsets)", arm, moved)


def _orders(n: int) -> Iterator[list[int]]:
    """Two joints swapped, neighbours first; and all reversed."""
    for i, j in sorted(itertools.combinations(range(n), 2), key=lambda pair: pair[1] - pair[0]):
        order = list(range(n))
        order[i], order[j] = j, i
        yield order
    yield list(range(n))[::-1]


def _untold(check: PoseCheck) -> tuple[str, ...]:
    """Joints that might turn the other way without the poses telling."""
    joints, found = check.joints, []
    q = joints.motors.angles(joints.values)
    for i, name in enumerate(joints.motors.joints):
        turned = Cause(name, joints.arm, q * np.where(np.arange(joints.arm.dof) == i, -1.0, 1.0))
        other = _compared(check.place, check.code, joints, TRIED, cause=turned)
        if other is not None and other.agrees:
            found.append(name)
    return tuple(found)


def _size(check: PoseCheck) -> float:
    return float(np.percentile(np.hypot(check.distance, LENGTH * check.angle), 90))


def _rows(count: int, most: int) -> NDArray[np.int_]:
    return np.unique(np.linspace(0, count - 1, most).astype(int))


def _same(T: Array, frames: Mapping[str, Array]) -> str:
    """Name of the frame that a pose is that of; "" if there is none."""
    gaps = {}
    for name, frame in frames.items():
        turn = np.linalg.norm(T[:3, :3] - frame[:3, :3]) / np.sqrt(8.0)
        gaps[name] = np.linalg.norm(T[:3, 3] - frame[:3, 3]), 2.0 * np.arcsin(min(turn, 1.0))
    near = {name: gap for name, gap in gaps.items() if gap[0] <= SAME[0] and gap[1] <= SAME[1]}
    return min(near, key=lambda name: near[name], default="")
