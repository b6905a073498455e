"""Arms for measurements and tests: the presets, models of example-robot-data, and arms by their makers' numbers.

All but the presets come as a URDF file and the names in it that a user would give; the rest is found.

The numbers: KUKA LBR iiwa 14 R820 as modified Denavit-Hartenberg parameters with the ranges and speeds of its data
sheet; Rethink Sawyer as the joint frames of its maker's description (`sawyer_description`).
"""

from collections.abc import Callable
from functools import partial
from math import cos, pi, radians, sin

from er_il import Arm
from er_il.arms.chain import ChainJoint, Tool, Triple, chain_urdf
from er_il.arms.presets import PRESETS
from er_il.arms.urdf import example_robot_data, generated_urdf

Range = tuple[float, float]


def _arm(name: str, joints: list[ChainJoint], tool: Tool) -> Arm:
    """The arm as by a file of the user's, without a word on its frames and joints."""
    return Arm.from_urdf(generated_urdf(chain_urdf(name, "base", joints, tool), f"{name}.urdf"))


def _joints(origins: list[tuple[Triple, Triple]], ranges: list[Range], speeds: list[float]) -> list[ChainJoint]:
    rows = enumerate(zip(origins, ranges, speeds, strict=True), start=1)
    return [ChainJoint(f"joint{i}", f"link{i}", xyz, rpy, span, speed) for i, ((xyz, rpy), span, speed) in rows]


def _origins(rows: list[tuple[float, float, float]]) -> list[tuple[Triple, Triple]]:
    """Joint frames from modified Denavit-Hartenberg rows: a [m], alpha [rad], d [m]."""
    return [((a, -sin(alpha) * d, cos(alpha) * d), (alpha, 0.0, 0.0)) for a, alpha, d in rows]


def iiwa14() -> Arm:
    """KUKA LBR iiwa 14 R820."""
    rows = [(0, 0, 0.36), (0, -pi / 2, 0), (0, pi / 2, 0.42), (0, pi / 2, 0)]
    rows += [(0, -pi / 2, 0.40), (0, -pi / 2, 0), (0, pi / 2, 0)]
    limits = [radians(angle) for angle in (170, 120, 170, 120, 170, 120, 175)]
    speeds = [radians(speed) for speed in (85, 85, 100, 75, 130, 135, 135)]
    joints = _joints(_origins(rows), [(-limit, limit) for limit in limits], speeds)
    return _arm("iiwa14", joints, Tool("flange", (0.0, 0.0, 0.126)))


def sawyer() -> Arm:
    """Rethink Robotics' Sawyer."""
    origins: list[tuple[Triple, Triple]] = [
        ((0.0, 0.0, 0.08), (0.0, 0.0, 0.0)),
        ((0.081, 0.05, 0.237), (-pi / 2, pi / 2, 0.0)),
        ((0.0, -0.14, 0.1425), (pi / 2, 0.0, 0.0)),
        ((0.0, -0.042, 0.26), (-pi / 2, 0.0, 0.0)),
        ((0.0, -0.125, -0.1265), (pi / 2, 0.0, 0.0)),
        ((0.0, 0.031, 0.275), (-pi / 2, 0.0, 0.0)),
        ((0.0, -0.11, 0.1053), (-pi / 2, -0.17453, pi)),
    ]
    ranges = [(-3.0503, 3.0503), (-3.8095, 2.2736), (-3.0426, 3.0426), (-3.0439, 3.0439)]
    ranges += [(-2.9761, 2.9761), (-2.9761, 2.9761), (-4.7124, 4.7124)]
    speeds = [1.74, 1.328, 1.957, 1.957, 3.485, 3.485, 4.545]
    return _arm("sawyer", _joints(origins, ranges, speeds), Tool("hand", (0.0, 0.0, 0.0245), (0.0, 0.0, pi / 2)))


def _example(name: str, file: str, base: str | None, tip: str) -> Arm:
    return Arm.from_urdf(example_robot_data(file), base_frame=base, ee_frame=tip, name=name)


def _named(name: str, file: str, tip: str, base: str | None = None) -> tuple[str, Callable[[], Arm]]:
    return name, partial(_example, name, file, base, tip)


REDUNDANT: dict[str, Callable[[], Arm]] = {
    **{name: partial(Arm.preset, name) for name in PRESETS},
    **{arm.__name__: arm for arm in (iiwa14, sawyer)},
    **dict(
        (
            _named("baxter", "baxter_description/urdf/baxter.urdf", "left_gripper", "left_arm_mount"),
            _named("tiago", "tiago_description/robots/tiago.urdf", "arm_tool_link", "torso_lift_link"),
            _named(
                "tiago_pro", "tiago_pro_description/robots/tiago_pro.urdf", "arm_left_tool_link", "torso_arm_left_link"
            ),
            _named("g1", "g1_description/urdf/g1_29dof_rev_1_0.urdf", "left_rubber_hand", "torso_link"),
            _named("pr2", "pr2_description/urdf/pr2.urdf", "l_gripper_tool_frame", "torso_lift_link"),
        )
    ),
}
SIX_JOINTS: dict[str, Callable[[], Arm]] = dict(
    (
        _named("ur5", "ur_description/urdf/ur5_robot.urdf", "tool0"),
        _named("j2s6s200", "kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    )
)
