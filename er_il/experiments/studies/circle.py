"""Elbow drift of inverse kinematics along a repeated circle.

The end effector's pose repeats with every lap. Inverse kinematics that is given the pose alone takes, each time, the
joints nearest to the current ones; small steps add up, and after a lap the elbow is elsewhere. ERJ commands one more
joint, so that the same action means the same configuration. Each solution is the seed of the next, as on an arm that
follows exactly.
"""

from collections.abc import Callable
from itertools import accumulate
from typing import Any

import numpy as np
from lerobot.model import RobotKinematics

from er_il.arms.arm import Arm, Vector
from er_il.arms.urdf import generated_urdf
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.base import Array
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import ArmError

Solver = Callable[[Vector, Array], Vector]  # a seed (n,) [rad] and T_base_ee (4, 4) to joints (n,) [rad]

RADIUS = 0.1  # [m]
LAPS = 5
POSES = 100  # a lap: five seconds at 20 Hz
DIGITS = 5  # of positions [m] in the report
EVERY = 5  # poses, of the elbow's path in the report


def targets(arm: Arm) -> Array:
    """Poses ``T_base_ee`` (LAPS * POSES, 4, 4) around a horizontal circle through the home posture's pose."""
    phase = 2 * np.pi * np.arange(1, LAPS * POSES + 1) / POSES
    poses = np.repeat(kinematics_of(arm).fk(arm.home)[None], len(phase), axis=0)
    poses[:, 0, 3] += RADIUS * (np.cos(phase) - 1)
    poses[:, 1, 3] += RADIUS * np.sin(phase)
    return poses


def drive_all(arm: Arm) -> dict[str, Array]:
    """Drive an arm around by LeRobot's inverse kinematics and in our action spaces, from its home posture.

    Returns:
        By solver, "lerobot" or a kind of action space: joints (LAPS * POSES + 1, n) [rad], the start first.
    """
    solvers = {"lerobot": _lerobot(arm)} | {kind: _ours(kind, arm) for kind in ("task", "erj", "era")}
    return {name: np.array(list(accumulate(targets(arm), solve, initial=arm.home))) for name, solve in solvers.items()}


def study_circle(arm: Arm) -> dict[str, Any]:
    """Drive an arm around; return what :func:`er_il.report.circle.circle_figure` draws, as JSON.

    Raises:
        ArmError: the arm has no redundancy, or no elbow is declared.
    """
    if arm.angle_frames is None or not arm.redundancy:
        raise ArmError(f"{arm.name} has no elbow to watch: it needs more than six joints, and angle frames.")
    kinematics, poses, frames = kinematics_of(arm), targets(arm), (arm.base_frame, *arm.joints, arm.ee_frame)
    drives = []
    for name, q in drive_all(arm).items():
        errors = np.array([kinematics.pose_error(pose, each) for pose, each in zip(poses, q[1:], strict=True)])
        links = np.stack([kinematics.fk_batch(q[::POSES], frame)[:, :3, 3] for frame in frames], axis=1)
        elbow = kinematics.fk_batch(q, arm.angle_frames.elbow)[:, :3, 3]
        drives.append(
            {
                "solver": name,
                "drift": np.linalg.norm(elbow[POSES::POSES] - elbow[0], axis=1).tolist(),  # [m] after each lap
                "max_position_error": float(errors[:, 0].max()),  # [m]
                "max_rotation_error": float(errors[:, 1].max()),  # [rad]
                "links": links.round(DIGITS).tolist(),  # [m] in the base frame, at the start and after each lap
                "elbow": elbow[::EVERY].round(DIGITS).tolist(),  # [m]
            }
        )
    how = {"arm": arm.name, "start": arm.home.tolist(), "radius": RADIUS, "laps": LAPS, "poses_a_lap": POSES}
    return {"meta": how | {"circle": poses[:POSES, :3, 3].round(DIGITS).tolist()}, "drives": drives}


def _lerobot(arm: Arm) -> Solver:
    """LeRobot's class as it is, with its own weights, in degrees."""
    solver = RobotKinematics(str(generated_urdf(arm.model_xml, arm.urdf.name)), arm.ee_frame, list(arm.joints))
    # Forward kinematics comes first, as in LeRobot's pipelines: else the first solution starts from the zero posture.
    T_world_base = solver.forward_kinematics(np.rad2deg(arm.home)) @ np.linalg.inv(kinematics_of(arm).fk(arm.home))
    return lambda seed, pose: np.deg2rad(solver.inverse_kinematics(np.rad2deg(seed), T_world_base @ pose))


def _ours(kind: str, arm: Arm) -> Solver:
    """An action space, given the pose and the redundancy value of the start."""
    space = make_arm_space(kind, arm)
    assert isinstance(space, PoseSpace)
    redundancy = space.redundancy_along(arm.home[None])[0]
    return lambda seed, pose: space.solve(pose, redundancy, seed).q
