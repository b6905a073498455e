"""Sanity checks of an arm's joint values, and the likely cause where they fail.

Each candidate cause (other units, another order, reversed joints, another arm) implies other joint
angles. It is accepted if those stay within the joint limits and, where the end effector's position
was recorded too, if forward kinematics agrees with it.
"""

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from er_il.arms.arm import Arm
from er_il.arms.presets import PRESETS
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.motors import UNITS, Motors

Array = NDArray[np.float64]

SAMPLES = 500  # frames that are looked at
ORDER_SAMPLES = 12  # frames that every order of the joints is tried on
LIMIT_TOLERANCE = 0.05  # [rad] by which measured joints may exceed a URDF's limits
OUTSIDE_TOLERANCE = 0.01  # share of values beyond their limits that proves nothing
STATIONARY = 0.12  # [rad] an arm whose joints all stay this close to zero was converted from degrees once too often
POSITION_TOLERANCE = 0.02  # [m] between recorded and computed end effector, after the best fit of their frames
IMPROVEMENT = 5.0  # a cause fits the recorded end effector better by this factor
MAX_ORDERS = 5040  # orders of the joints that are tried one by one


@dataclass(frozen=True)
class JointSample:
    """Joint values of one arm as recorded, and where its end effector was recorded to be."""

    arm: Arm
    motors: Motors
    values: Array  # (N, n) in the order and the units of the motors
    positions: Array | None  # (N, 3) [m] in any fixed frame

    def thinned(self) -> "JointSample":
        """The same with few frames, spread evenly over those that hold numbers."""
        finite = np.flatnonzero(np.all(np.isfinite(self.values), axis=1))
        rows = finite[np.unique(np.linspace(0, len(finite) - 1, SAMPLES).astype(int))] if len(finite) else finite
        positions = None if self.positions is None else self.positions[rows]
        return replace(self, values=self.values[rows], positions=positions)


@dataclass(frozen=True)
class Cause:
    """A mistake in the declaration of the arm that would explain the values."""

    text: str
    arm: Arm
    q: Array  # (N, n) [rad] what the angles would be


def check_joint_values(given: JointSample) -> str:
    """Describe what is wrong with joint values and the likely causes; "" if they are plausible."""
    sample = given.thinned()
    if not len(sample.values):
        return "There is no frame in which all joint values are numbers."
    q = sample.motors.angles(sample.values)
    beyond, off = share_outside(sample.arm, q), _position_error(sample.arm, q, sample.positions)
    still = sample.motors.units == "deg" and np.abs(q).max() < STATIONARY
    order = _order_by_name(sample)
    if beyond <= OUTSIDE_TOLERANCE and off <= POSITION_TOLERANCE and not still and order is None:
        return ""
    found = [order] if order is not None else []
    for cause in _causes(sample):
        if share_outside(cause.arm, cause.q) > OUTSIDE_TOLERANCE:
            continue
        better = _position_error(cause.arm, cause.q, sample.positions)
        if off > POSITION_TOLERANCE and better > max(POSITION_TOLERANCE, off / IMPROVEMENT):
            continue
        if beyond > OUTSIDE_TOLERANCE or still or off > POSITION_TOLERANCE:
            found.append(cause)
    if off > POSITION_TOLERANCE:
        found.sort(key=lambda each: _position_error(each.arm, each.q, sample.positions) > POSITION_TOLERANCE)
    return f"{_symptom(sample, q, beyond, off, still)} {_verdict([each.text for each in found])}"


def _symptom(sample: JointSample, q: Array, beyond: float, off: float, still: bool) -> str:
    arm = sample.arm
    if beyond > OUTSIDE_TOLERANCE:
        excess = np.maximum(arm.lower - q, q - arm.upper).max(axis=0)
        worst = int(excess.argmax())
        return (
            f"{beyond:.0%} of the joint values are outside {arm.name}'s limits, {sample.motors.joints[worst]} as "
            f"{arm.joints[worst]} by up to {excess[worst]:.2f} rad."
        )
    if still:
        return f"The joints of {arm.name} never leave zero by more than {np.abs(q).max():.3f} rad."
    if off > POSITION_TOLERANCE:
        return f"The recorded end effector is {off:.2f} m away from where {arm.name}'s kinematics has it."
    return "The joints' names are in another order than the arm's."


def _verdict(texts: Sequence[str]) -> str:
    if not texts:
        return "It looks like another arm, or offsets between motors and URDF are missing."
    others = f" It could also be: {'; '.join(texts[1:4])}." if texts[1:] else ""
    return f"It looks like {texts[0]}.{others}"


def _causes(sample: JointSample) -> Iterator[Cause]:
    arm, motors, values = sample.arm, sample.motors, sample.values
    for units in UNITS:
        if units != motors.units:
            q = replace(motors, units=units).angles(values)
            if np.abs(q).max() >= STATIONARY:
                long = {"deg": "degrees", "rad": "radians"}
                text = f"wrong units: the values are {long[units]}, not {long[motors.units]} (--units {units})"
                yield Cause(text, arm, q)
    q = motors.angles(values)
    for name in PRESETS:
        other = Arm.preset(name)
        if name != arm.name and other.dof == arm.dof:
            yield Cause(f"the wrong arm: the values fit {name} (--arm {name})", other, q)
    if (order := _best_order(sample, q)) is not None:
        names = " ".join(motors.joints[i] for i in order)
        yield Cause(f"the wrong joint order: they fit as --joints {names}", arm, q[:, order])
    signs = _best_signs(sample, q)
    if np.any(signs < 0):
        reversed_joints = ", ".join(joint for joint, sign in zip(motors.joints, signs, strict=True) if sign < 0)
        yield Cause(f"joints that turn the other way: {reversed_joints} (--signs)", arm, q * signs)


def _order_by_name(sample: JointSample) -> Cause | None:
    """The order that numbers in the names tell, if they tell another one."""
    numbers = [_numbers(names) for names in (sample.motors.joints, sample.arm.joints)]
    if any(len(set(each)) != len(each) or None in each for each in numbers):
        return None
    ranks = [np.argsort(np.argsort(np.array(each, dtype=int))) for each in numbers]
    if np.array_equal(ranks[0], ranks[1]):
        return None
    order = [int(np.flatnonzero(ranks[0] == rank)[0]) for rank in ranks[1]]
    names = " ".join(sample.motors.joints[i] for i in order)
    q = sample.motors.angles(sample.values)[:, order]
    return Cause(f"the wrong joint order: by their names it is --joints {names}", sample.arm, q)


def _numbers(names: Sequence[str]) -> list[int | None]:
    found = (re.findall(r"\d+", name) for name in names)
    return [int(each[-1]) if each else None for each in found]


def _best_order(sample: JointSample, q: Array) -> list[int] | None:
    """The other order of joints that fits best: the recorded end effector if there is one, else the limits."""
    arm, n = sample.arm, sample.arm.dof
    excess = np.maximum(arm.lower - q[:, :, None], q[:, :, None] - arm.upper)  # (N, value, joint)
    outside = (excess > LIMIT_TOLERANCE).mean(axis=0)
    if sample.positions is None or math.factorial(n) > MAX_ORDERS:
        from scipy.optimize import linear_sum_assignment  # half a second of imports, which plausible values do without

        # As few joints as possible elsewhere; among those, near the middle of their ranges.
        middle = np.abs(q.mean(axis=0)[:, None] - (arm.lower + arm.upper) / 2) / (arm.upper - arm.lower)
        order = linear_sum_assignment((outside + 1e-2 * (1 - np.eye(n)) + 1e-4 * middle).T)[1].tolist()
    else:
        few, positions = _few(q), _few(sample.positions)
        possible = outside <= OUTSIDE_TOLERANCE
        orders = [each for each in itertools.permutations(range(n)) if all(possible[each[j], j] for j in range(n))]
        if not orders:
            return None
        order = list(min(orders, key=lambda each: _position_error(arm, few[:, each], positions)))
    return None if order == list(range(n)) else order


def _best_signs(sample: JointSample, q: Array) -> Array:
    arm = sample.arm
    beyond = [
        ((arm.lower - LIMIT_TOLERANCE > s * q) | (s * q > arm.upper + LIMIT_TOLERANCE)).mean(axis=0) for s in (1, -1)
    ]
    signs = np.where(beyond[0] > beyond[1] + OUTSIDE_TOLERANCE, -1.0, 1.0)
    if sample.positions is None or arm.dof > 8:
        return signs
    few, positions = _few(q), _few(sample.positions)
    choices = np.array(list(itertools.product((1.0, -1.0), repeat=arm.dof)))
    return min(choices, key=lambda each: _position_error(arm, few * each, positions))


def _few(rows: Array) -> Array:
    return rows[np.unique(np.linspace(0, len(rows) - 1, ORDER_SAMPLES).astype(int))]


def share_outside(arm: Arm, q: Array) -> float:
    """Share of joint values that are outside their limits."""
    return float(((q < arm.lower - LIMIT_TOLERANCE) | (q > arm.upper + LIMIT_TOLERANCE)).mean())


def _position_error(arm: Arm, q: Array, positions: Array | None) -> float:
    """Root mean square distance [m] of recorded and computed positions, their frames fitted; 0 if none is recorded."""
    if positions is None:
        return 0.0
    computed = kinematics_of(arm).fk_batch(q)[:, :3, 3]
    one, other = computed - computed.mean(axis=0), positions - positions.mean(axis=0)
    U, scales, Vt = np.linalg.svd(one.T @ other)
    scales[-1] *= np.sign(np.linalg.det(U @ Vt))  # a rotation, no reflection
    squares = (one**2).sum() + (other**2).sum() - 2 * scales.sum()
    return math.sqrt(max(0.0, squares) / len(one))
