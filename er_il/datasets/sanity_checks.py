"""Suspicion: joint values that do not look like this arm's, and what they look like instead.

Each explanation (other units, another order, reversed joints, another arm) says what the arm's
angles would be if it were true. It is believed where those angles stay within the joint limits and,
if the end effector's position was recorded too, where forward kinematics then agrees with it.
"""

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from er_il.arms.arm import Arm
from er_il.arms.presets import PRESETS
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.motors import UNITS, Motors

Array = NDArray[np.float64]

SAMPLES = 500  # frames that are looked at
FEW = 12  # frames that every order of the joints is tried on
BEYOND = 0.05  # [rad] by which measured joints may exceed a URDF's limits
TOLERATED = 0.01  # share of values beyond their limits that proves nothing
STILL = 0.12  # [rad] an arm whose joints all stay this close to zero was converted from degrees once too often
OFF = 0.02  # [m] between recorded and computed end effector, after the best fit of their frames
MUCH = 5.0  # an explanation fits the recorded end effector better by this factor
MAX_ORDERS = 5040  # orders of the joints that are tried one by one


@dataclass(frozen=True)
class Evidence:
    """Joint values of one arm as recorded, and where its end effector was recorded to be."""

    arm: Arm
    motors: Motors
    values: Array  # (N, n) in the order and the units of the motors
    positions: Array | None  # (N, 3) [m] in any fixed frame

    def sampled(self) -> "Evidence":
        """The same with few frames, spread evenly over those that hold numbers."""
        finite = np.flatnonzero(np.all(np.isfinite(self.values), axis=1))
        rows = finite[np.unique(np.linspace(0, len(finite) - 1, SAMPLES).astype(int))] if len(finite) else finite
        positions = None if self.positions is None else self.positions[rows]
        return replace(self, values=self.values[rows], positions=positions)


@dataclass(frozen=True)
class Explanation:
    """A mistake that would explain the values."""

    text: str
    arm: Arm
    q: Array  # (N, n) [rad] what the angles would be


def suspect(evidence: Evidence) -> str:
    """Say what is wrong with the values and what they look like; "" if nothing is."""
    sample = evidence.sampled()
    if not len(sample.values):
        return "There is no frame in which all joint values are numbers."
    q = sample.motors.angles(sample.values)
    beyond, off = _beyond(sample.arm, q), _off(sample.arm, q, sample.positions)
    still = sample.motors.units == "deg" and np.abs(q).max() < STILL
    order = _order_by_name(sample)
    if beyond <= TOLERATED and off <= OFF and not still and order is None:
        return ""
    found = [order] if order is not None else []
    for explanation in _explanations(sample):
        if _beyond(explanation.arm, explanation.q) > TOLERATED:
            continue
        better = _off(explanation.arm, explanation.q, sample.positions)
        if off > OFF and better > max(OFF, off / MUCH):
            continue
        if beyond > TOLERATED or still or off > OFF:
            found.append(explanation)
    if off > OFF:
        found.sort(key=lambda each: _off(each.arm, each.q, sample.positions) > OFF)
    return f"{_symptom(sample, q, beyond, off, still)} {_verdict([each.text for each in found])}"


def _symptom(sample: Evidence, q: Array, beyond: float, off: float, still: bool) -> str:
    arm = sample.arm
    if beyond > TOLERATED:
        excess = np.maximum(arm.lower - q, q - arm.upper).max(axis=0)
        worst = int(excess.argmax())
        return (
            f"{beyond:.0%} of the joint values are outside {arm.name}'s limits, {sample.motors.joints[worst]} as "
            f"{arm.joints[worst]} by up to {excess[worst]:.2f} rad."
        )
    if still:
        return f"The joints of {arm.name} never leave zero by more than {np.abs(q).max():.3f} rad."
    if off > OFF:
        return f"The recorded end effector is {off:.2f} m away from where {arm.name}'s kinematics has it."
    return "The joints' names are in another order than the arm's."


def _verdict(texts: Sequence[str]) -> str:
    if not texts:
        return "It looks like another arm, or offsets between motors and URDF are missing."
    others = f" It could also be: {'; '.join(texts[1:4])}." if texts[1:] else ""
    return f"It looks like {texts[0]}.{others}"


def _explanations(sample: Evidence) -> Iterator[Explanation]:
    arm, motors, values = sample.arm, sample.motors, sample.values
    for units in UNITS:
        if units != motors.units:
            q = replace(motors, units=units).angles(values)
            if np.abs(q).max() >= STILL:
                long = {"deg": "degrees", "rad": "radians"}
                text = f"wrong units: the values are {long[units]}, not {long[motors.units]} (--units {units})"
                yield Explanation(text, arm, q)
    q = motors.angles(values)
    for name in PRESETS:
        other = Arm.preset(name)
        if name != arm.name and other.dof == arm.dof:
            yield Explanation(f"the wrong arm: the values fit {name} (--arm {name})", other, q)
    if (order := _best_order(sample, q)) is not None:
        names = " ".join(motors.joints[i] for i in order)
        yield Explanation(f"the wrong joint order: they fit as --joints {names}", arm, q[:, order])
    signs = _best_signs(sample, q)
    if np.any(signs < 0):
        reversed_joints = ", ".join(joint for joint, sign in zip(motors.joints, signs, strict=True) if sign < 0)
        yield Explanation(f"joints that turn the other way: {reversed_joints} (--signs)", arm, q * signs)


def _order_by_name(sample: Evidence) -> Explanation | None:
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
    return Explanation(f"the wrong joint order: by their names it is --joints {names}", sample.arm, q)


def _numbers(names: Sequence[str]) -> list[int | None]:
    found = (re.findall(r"\d+", name) for name in names)
    return [int(each[-1]) if each else None for each in found]


def _best_order(sample: Evidence, q: Array) -> list[int] | None:
    """The other order of joints that fits best: the recorded end effector if there is one, else the limits."""
    arm, n = sample.arm, sample.arm.dof
    excess = np.maximum(arm.lower - q[:, :, None], q[:, :, None] - arm.upper)  # (N, value, joint)
    outside = (excess > BEYOND).mean(axis=0)
    if sample.positions is None or math.factorial(n) > MAX_ORDERS:
        # As few joints as possible elsewhere; among those, near the middle of their ranges.
        middle = np.abs(q.mean(axis=0)[:, None] - (arm.lower + arm.upper) / 2) / (arm.upper - arm.lower)
        order = linear_sum_assignment((outside + 1e-2 * (1 - np.eye(n)) + 1e-4 * middle).T)[1].tolist()
    else:
        few, positions = _few(q), _few(sample.positions)
        possible = outside <= TOLERATED
        orders = [each for each in itertools.permutations(range(n)) if all(possible[each[j], j] for j in range(n))]
        if not orders:
            return None
        order = list(min(orders, key=lambda each: _off(arm, few[:, each], positions)))
    return None if order == list(range(n)) else order


def _best_signs(sample: Evidence, q: Array) -> Array:
    arm = sample.arm
    beyond = [((arm.lower - BEYOND > s * q) | (s * q > arm.upper + BEYOND)).mean(axis=0) for s in (1, -1)]
    signs = np.where(beyond[0] > beyond[1] + TOLERATED, -1.0, 1.0)
    if sample.positions is None or arm.dof > 8:
        return signs
    few, positions = _few(q), _few(sample.positions)
    choices = np.array(list(itertools.product((1.0, -1.0), repeat=arm.dof)))
    return min(choices, key=lambda each: _off(arm, few * each, positions))


def _few(rows: Array) -> Array:
    return rows[np.unique(np.linspace(0, len(rows) - 1, FEW).astype(int))]


def _beyond(arm: Arm, q: Array) -> float:
    """Share of joint values that are outside their limits."""
    return float(((q < arm.lower - BEYOND) | (q > arm.upper + BEYOND)).mean())


def _off(arm: Arm, q: Array, positions: Array | None) -> float:
    """Root mean square distance [m] of recorded and computed positions, their frames fitted; 0 if none is recorded."""
    if positions is None:
        return 0.0
    computed = kinematics_of(arm).fk_batch(q)[:, :3, 3]
    one, other = computed - computed.mean(axis=0), positions - positions.mean(axis=0)
    U, scales, Vt = np.linalg.svd(one.T @ other)
    scales[-1] *= np.sign(np.linalg.det(U @ Vt))  # a rotation, no reflection
    squares = (one**2).sum() + (other**2).sum() - 2 * scales.sum()
    return math.sqrt(max(0.0, squares) / len(one))
