"""OpenArm in MuJoCo: two arms on a pedestal, with capsules and boxes as large as the links of version 2.

Joints, ranges and torques are the robot's; the hand is simpler, its fingers slide as version 1's do. Torques and
masses are those of the published description (er_il.arms.openarm); the weight is compensated.
"""

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import mujoco

from er_il.arms.arm import Arm
from sim_tasks.world.props import BOX, CAPSULE, CYLINDER, SPHERE
from sim_tasks.world.robot import BLACK, FINGER_TRAVEL, GREY, WHITE, RobotModel, add_gripper, add_servo, set_physics
from sim_tasks.world.scene import FLOOR

TORQUES = (40.0, 40.0, 27.0, 27.0, 7.0, 7.0, 7.0)  # [Nm] of the motors
MASSES = (1.142, 0.278, 1.074, 0.635, 0.616, 0.475, 0.528)  # [kg] of the links
# Capsules of the links but the hand: end points [m] in the left link's frame, and radius. Every second one is dark.
CAPSULES = (
    ((0.0, 0.0, 0.0), (0.0, 0.055, 0.0), 0.045),
    ((0.0, 0.0, 0.0), (0.0, 0.0, -0.02), 0.045),
    ((0.0, 0.0, -0.035), (0.0, 0.0, -0.145), 0.036),
    ((0.0, 0.0, 0.0), (0.0, 0.0, -0.06), 0.040),
    ((0.0, 0.0, -0.03), (0.0, 0.0, -0.085), 0.036),
    ((0.0, -0.005, 0.0), (0.0, 0.005, 0.0), 0.032),
)
PALM = ((0.006, 0.0, -0.075), (0.036, 0.045, 0.036))  # [m] centre and half sides, from the wrist
FINGER = ((0.012, 0.006, 0.030), -0.140, 0.06)  # [m] half sides, height of the centre; [kg]
RUBBER = (1.2, 0.02, 0.0005)  # friction


def openarm_spec(arms: Mapping[str, Arm]) -> mujoco.MjSpec:
    """Build the robot of these arms, ``left`` and ``right``; its base frame is the world's origin."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    set_physics(spec)
    _add_pedestal(spec)
    for label, arm in arms.items():
        _add_arm(spec, label, arm)
    return spec


def openarm_models(model: mujoco.MjModel, arms: Mapping[str, Arm]) -> list[RobotModel]:
    """Look the arms up in a compiled model."""
    return [RobotModel.of(model, arm, root(label), _fingers(label), _gripper(label)) for label, arm in arms.items()]


def root(label: str) -> str:
    """Name of an arm's lowest body."""
    return f"openarm_{label}_link1"


def fingertips(label: str) -> tuple[str, str]:
    """Names of the bodies of a hand's fingers."""
    one, other = _fingers(label)
    return f"{one}_body", f"{other}_body"


def _add_arm(spec: mujoco.MjSpec, label: str, arm: Arm) -> None:
    body, side = spec.worldbody, 1.0 if label == "left" else -1.0
    shapes = (*CAPSULES, None)
    joints = {element.get("name"): element for element in ET.fromstring(arm.model_xml).iter("joint")}
    for i, (name, torque, mass, shape) in enumerate(zip(arm.joints, TORQUES, MASSES, shapes, strict=True)):
        element = joints[name]
        body = body.add_body(name=_text(element, "child", "link"), pos=_numbers(element, "origin", "xyz"), gravcomp=1)
        joint = body.add_joint(name=name, axis=_numbers(element, "axis", "xyz"))
        joint.range = _numbers(element, "limit", "lower") + _numbers(element, "limit", "upper")
        joint.actfrcrange = (-torque, torque)
        if shape is None:
            centre, half = PALM
            body.add_geom(type=BOX, size=half, pos=centre, mass=mass, rgba=GREY)
        else:
            (start, end, radius), look = shape, BLACK if i % 2 else WHITE
            ends = [coordinate for x, y, z in (start, end) for coordinate in (x, side * y, z)]
            body.add_geom(type=CAPSULE, fromto=ends, size=(radius, 0, 0), mass=mass, rgba=look)
        add_servo(spec, name)
    size, height, mass = FINGER
    for name, direction in zip(_fingers(label), (1.0, -1.0), strict=True):
        finger = body.add_body(name=f"{name}_body", pos=(0.0, direction * size[1], height), gravcomp=1)
        slide = finger.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, direction, 0.0))
        slide.range, slide.armature = (0.0, FINGER_TRAVEL), 0.1
        finger.add_geom(type=BOX, size=size, mass=mass, rgba=BLACK, friction=RUBBER, condim=4)
    add_gripper(spec, _gripper(label), _fingers(label))
    links = [f"openarm_{label}_link{i}" for i in range(1, 8)]
    for one, other in ((links[4], links[6]), (links[1], links[3])):  # hulls that overlap by design, not by collision
        spec.add_exclude(bodyname1=one, bodyname2=other)


def _add_pedestal(spec: mujoco.MjSpec) -> None:
    """What carries the arms, to look at: they cannot reach it."""
    seen = {"contype": 0, "conaffinity": 0, "group": 2}
    world, height = spec.worldbody, -FLOOR / 2
    world.add_geom(name="pedestal", type=BOX, size=(0.03, 0.03, height), pos=(0, 0, -height), rgba=BLACK, **seen)
    world.add_geom(name="foot", type=BOX, size=(0.2, 0.2, 0.015), pos=(0, 0, FLOOR + 0.015), rgba=GREY, **seen)
    ends = (0.0, -0.09, 0.0, 0.0, 0.09, 0.0)
    world.add_geom(name="shoulders", type=CYLINDER, fromto=ends, size=(0.05, 0, 0), rgba=BLACK, **seen)
    world.add_geom(name="neck", type=CYLINDER, fromto=(0, 0, 0, 0, 0, 0.14), size=(0.025, 0, 0), rgba=BLACK, **seen)
    world.add_geom(name="head", type=SPHERE, size=(0.07, 0, 0), pos=(0, 0, 0.2), rgba=WHITE, **seen)


def _fingers(label: str) -> tuple[str, str]:
    return f"openarm_{label}_finger_joint1", f"openarm_{label}_finger_joint2"


def _gripper(label: str) -> str:
    return f"{label}_gripper"


def _text(element: ET.Element, tag: str, key: str) -> str:
    found = element.find(tag)
    assert found is not None  # er_il's own URDF has all of them
    return found.get(key, "")


def _numbers(element: ET.Element, tag: str, key: str) -> list[float]:
    return [float(number) for number in _text(element, tag, key).split()]
