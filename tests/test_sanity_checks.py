from dataclasses import replace

import numpy as np
import pytest
from foreign import paths

from er_il import Arm
from er_il.datasets.sanity_checks import JointSample, check_joint_values
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.motors import Motors

PANDA, XARM = Arm.preset("panda"), Arm.preset("xarm7")
NUMBERED = tuple(f"joint_{i}" for i in range(1, 8))
NAMED = ("base", "shoulder", "upper_arm", "elbow", "forearm", "wrist", "flange")


def _sample(arm=PANDA, names=NAMED, units="rad", recorded=False):
    q = np.concatenate(paths(arm, 0, reach=0.6))
    positions = kinematics_of(arm).fk_batch(q)[:, :3, 3] + [0.1, 0.2, 0.3] if recorded else None
    return JointSample(arm, Motors(names, units), q if units == "rad" else np.rad2deg(q), positions)


@pytest.mark.parametrize("arm", [PANDA, XARM])
@pytest.mark.parametrize("units", ["rad", "deg"])
@pytest.mark.parametrize("recorded", [True, False])
def test_values_of_the_right_arm_are_not_suspected(arm, units, recorded):
    assert check_joint_values(_sample(arm, NUMBERED, units, recorded)) == ""


@pytest.mark.parametrize(("real", "claimed"), [("deg", "rad"), ("rad", "deg")])
@pytest.mark.parametrize("arm", [PANDA, XARM])
def test_wrong_units(arm, real, claimed):
    sample = _sample(arm, units=real)
    text = check_joint_values(replace(sample, motors=Motors(NAMED, claimed)))
    assert f"It looks like wrong units: the values are {'degrees' if real == 'deg' else 'radians'}" in text
    assert f"--units {real}" in text


def test_the_wrong_arm():
    assert "It looks like the wrong arm: the values fit xarm7" in check_joint_values(replace(_sample(XARM), arm=PANDA))
    assert "It looks like the wrong arm: the values fit panda" in check_joint_values(replace(_sample(PANDA), arm=XARM))


def test_an_unknown_arm_or_offsets():
    sample = _sample()
    text = check_joint_values(replace(sample, values=sample.values * 0.2 + 2.5))
    assert "outside panda's limits" in text
    assert "another arm, or offsets" in text


def test_the_order_that_names_tell_even_within_the_limits():
    order = [4, 1, 2, 3, 0, 5, 6]
    sample = _sample(names=NUMBERED)
    names = tuple(NUMBERED[i] for i in order)
    text = check_joint_values(replace(sample, motors=Motors(names), values=sample.values[:, order]))
    assert f"by their names it is --joints {' '.join(NUMBERED)}" in text


def test_the_order_that_only_the_limits_tell():
    order = [0, 1, 2, 5, 4, 3, 6]  # joint 4 of a Panda is never positive, joint 6 never negative
    sample = _sample()
    names = tuple(NAMED[i] for i in order)
    text = check_joint_values(replace(sample, motors=Motors(names), values=sample.values[:, order]))
    assert f"the wrong joint order: they fit as --joints {' '.join(NAMED)}" in text


def test_the_order_that_only_the_recorded_end_effector_tells():
    order = [2, 1, 0, 3, 4, 5, 6]
    sample = _sample(recorded=True)
    names = tuple(NAMED[i] for i in order)
    shuffled = replace(sample, motors=Motors(names), values=sample.values[:, order])
    assert check_joint_values(replace(shuffled, positions=None)) == ""  # nothing there could tell
    text = check_joint_values(shuffled)
    assert "The recorded end effector is" in text
    assert f"It looks like the wrong joint order: they fit as --joints {' '.join(NAMED)}" in text


def test_a_reversed_joint():
    sample = _sample()
    signs = np.array([1, 1, 1, -1, 1, 1, 1])
    text = check_joint_values(replace(sample, values=sample.values * signs))
    assert "joints that turn the other way: elbow (--signs)" in text
    recorded = _sample(recorded=True)
    text = check_joint_values(replace(recorded, values=recorded.values * [1, 1, -1, 1, 1, 1, 1]))
    assert "It looks like joints that turn the other way: upper_arm (--signs)" in text
