from dataclasses import replace

import numpy as np
import pytest
from foreign import paths

from er_il import Arm
from er_il.datasets.sanity_checks import Evidence, suspect
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.motors import Motors

PANDA, XARM = Arm.preset("panda"), Arm.preset("xarm7")
NUMBERED = tuple(f"joint_{i}" for i in range(1, 8))
NAMED = ("base", "shoulder", "upper_arm", "elbow", "forearm", "wrist", "flange")


def _evidence(arm=PANDA, names=NAMED, units="rad", recorded=False):
    q = np.concatenate(paths(arm, 0, reach=0.6))
    positions = kinematics_of(arm).fk_batch(q)[:, :3, 3] + [0.1, 0.2, 0.3] if recorded else None
    return Evidence(arm, Motors(names, units), q if units == "rad" else np.rad2deg(q), positions)


@pytest.mark.parametrize("arm", [PANDA, XARM])
@pytest.mark.parametrize("units", ["rad", "deg"])
@pytest.mark.parametrize("recorded", [True, False])
def test_values_of_the_right_arm_are_not_suspected(arm, units, recorded):
    assert suspect(_evidence(arm, NUMBERED, units, recorded)) == ""


@pytest.mark.parametrize(("real", "claimed"), [("deg", "rad"), ("rad", "deg")])
@pytest.mark.parametrize("arm", [PANDA, XARM])
def test_wrong_units(arm, real, claimed):
    evidence = _evidence(arm, units=real)
    text = suspect(replace(evidence, motors=Motors(NAMED, claimed)))
    assert f"It looks like wrong units: the values are {'degrees' if real == 'deg' else 'radians'}" in text
    assert f"--units {real}" in text


def test_the_wrong_arm():
    assert "It looks like the wrong arm: the values fit xarm7" in suspect(replace(_evidence(XARM), arm=PANDA))
    assert "It looks like the wrong arm: the values fit panda" in suspect(replace(_evidence(PANDA), arm=XARM))


def test_an_unknown_arm_or_offsets():
    evidence = _evidence()
    text = suspect(replace(evidence, values=evidence.values * 0.2 + 2.5))
    assert "outside panda's limits" in text
    assert "another arm, or offsets" in text


def test_the_order_that_names_tell_even_within_the_limits():
    order = [4, 1, 2, 3, 0, 5, 6]
    evidence = _evidence(names=NUMBERED)
    names = tuple(NUMBERED[i] for i in order)
    text = suspect(replace(evidence, motors=Motors(names), values=evidence.values[:, order]))
    assert f"by their names it is --joints {' '.join(NUMBERED)}" in text


def test_the_order_that_only_the_limits_tell():
    order = [0, 1, 2, 5, 4, 3, 6]  # joint 4 of a Panda is never positive, joint 6 never negative
    evidence = _evidence()
    names = tuple(NAMED[i] for i in order)
    text = suspect(replace(evidence, motors=Motors(names), values=evidence.values[:, order]))
    assert f"the wrong joint order: they fit as --joints {' '.join(NAMED)}" in text


def test_the_order_that_only_the_recorded_end_effector_tells():
    order = [2, 1, 0, 3, 4, 5, 6]
    evidence = _evidence(recorded=True)
    names = tuple(NAMED[i] for i in order)
    shuffled = replace(evidence, motors=Motors(names), values=evidence.values[:, order])
    assert suspect(replace(shuffled, positions=None)) == ""  # nothing there could tell
    text = suspect(shuffled)
    assert "The recorded end effector is" in text
    assert f"It looks like the wrong joint order: they fit as --joints {' '.join(NAMED)}" in text


def test_a_reversed_joint():
    evidence = _evidence()
    signs = np.array([1, 1, 1, -1, 1, 1, 1])
    text = suspect(replace(evidence, values=evidence.values * signs))
    assert "joints that turn the other way: elbow (--signs)" in text
    recorded = _evidence(recorded=True)
    text = suspect(replace(recorded, values=recorded.values * [1, 1, -1, 1, 1, 1, 1]))
    assert "It looks like joints that turn the other way: upper_arm (--signs)" in text
