"""The end effector on a circle, lap after lap: where does the elbow go?

The hand's pose repeats with every lap. Inverse kinematics that is told the pose alone takes, each
time, the joints nearest to where they are; small steps add up, and after a lap the elbow is not
where it was. ERJ commands one more joint, so the same action means the same arm.

Everything is kinematics: each solution is the seed of the next, as on an arm that follows exactly.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from lerobot.model import RobotKinematics
from numpy.typing import NDArray

from er_il.arms.arm import Arm, Vector
from er_il.arms.urdf import generated_urdf
from er_il.kinematics.solver import kinematics_of
from er_il.report.markdown import markdown_table
from er_il.spaces.pose import PoseSpace
from er_il.spaces.registry import make_arm_space
from er_il.support.atomic_files import write_json
from er_il.support.errors import ArmError
from er_il.support.provenance import provenance

Array = NDArray[np.float64]
Solver = Callable[[Array, Vector], Vector]  # T_base_ee (4, 4) and a seed (n,) [rad] to joints (n,) [rad]

RADIUS = 0.1  # [m]
LAPS = 5
POSES = 100  # a lap: five seconds at 20 Hz
LEROBOT = "lerobot"
OURS = ("task", "erj", "era")
NAMES = {LEROBOT: "LeRobot's IK", "task": "er_il, task space", "erj": "er_il, ERJ", "era": "er_il, ERA"}


@dataclass(frozen=True)
class Drive:
    """One way of solving, driven around the circle."""

    solver: str
    q: Array  # (LAPS * POSES + 1, n) [rad], the start first
    elbow: Array  # (LAPS * POSES + 1, 3) [m] in the base frame
    position_error: float  # [m] largest distance of the end effector from its target
    rotation_error: float  # [rad]

    @property
    def drift(self) -> Array:
        """(LAPS,) [m] distance of the elbow from its start, at the end of each lap."""
        return np.linalg.norm(self.elbow[POSES::POSES] - self.elbow[0], axis=1)

    def report(self) -> dict[str, Any]:
        """Return the drive as JSON."""
        return {
            "solver": self.solver,
            "drift": self.drift.tolist(),
            "max_position_error": self.position_error,
            "max_rotation_error": self.rotation_error,
        }


def targets(arm: Arm) -> Array:
    """Poses ``T_base_ee`` (LAPS * POSES, 4, 4) around a horizontal circle through the home posture's pose."""
    phase = 2 * np.pi * np.arange(1, LAPS * POSES + 1) / POSES
    poses = np.repeat(kinematics_of(arm).fk(arm.home)[None], len(phase), axis=0)
    poses[:, 0, 3] += RADIUS * (np.cos(phase) - 1)
    poses[:, 1, 3] += RADIUS * np.sin(phase)
    return poses


def drive_all(arm: Arm) -> list[Drive]:
    """Drive an arm around by LeRobot's inverse kinematics and in our action spaces, from its home posture.

    Raises:
        ArmError: the arm has no spare joint, or no elbow is declared.
    """
    if arm.angle_frames is None or not arm.redundancy:
        raise ArmError(f"{arm.name} has no elbow to watch: it needs more than six joints, and angle frames.")
    solvers = {LEROBOT: _lerobot(arm)} | {kind: _ours(kind, arm) for kind in OURS}
    return [_drive(name, solve, arm) for name, solve in solvers.items()]


def write_report(arm: Arm, drives: Sequence[Drive], path: Path) -> None:
    """Write what was measured, and how, as JSON."""
    how = {"arm": arm.name, "start": arm.home.tolist(), "radius": RADIUS, "laps": LAPS, "poses_a_lap": POSES}
    write_json(path, {"meta": provenance() | how, "drives": [drive.report() for drive in drives]})


def drift_table(report: Mapping[str, Any]) -> str:
    """Render a report as a Markdown table."""
    laps = range(1, report["meta"]["laps"] + 1)
    headings = ["Elbow from its start after", *(f"lap {lap}" for lap in laps), "Hand off its way by at most"]
    rows = []
    for drive in report["drives"]:
        drift = [f"{100 * each:.1f} cm" for each in drive["drift"]]
        rows.append([NAMES[drive["solver"]], *drift, f"{1e3 * drive['max_position_error']:.2f} mm"])
    return markdown_table(headings, rows)


def _drive(name: str, solve: Solver, arm: Arm) -> Drive:
    kinematics, poses = kinematics_of(arm), targets(arm)
    path = [arm.home]
    for pose in poses:
        path.append(solve(pose, path[-1]))
    q = np.array(path)
    misses = np.array([kinematics.pose_error(pose, each) for pose, each in zip(poses, q[1:], strict=True)])
    assert arm.angle_frames is not None
    elbow = kinematics.fk_batch(q, arm.angle_frames.elbow)[:, :3, 3]
    position, rotation = misses.max(axis=0)
    return Drive(name, q, elbow, float(position), float(rotation))


def _lerobot(arm: Arm) -> Solver:
    """LeRobot's class as it is, with its own weights, in degrees.

    Its forward kinematics comes first, as in its pipelines: alone, the first solution would start
    from the zero posture, whatever the seed.
    """
    solver = RobotKinematics(str(generated_urdf(arm.model_xml, arm.urdf.name)), arm.ee_frame, list(arm.joints))
    T_world_base = solver.forward_kinematics(np.rad2deg(arm.home)) @ np.linalg.inv(kinematics_of(arm).fk(arm.home))
    return lambda pose, seed: np.deg2rad(solver.inverse_kinematics(np.rad2deg(seed), T_world_base @ pose))


def _ours(kind: str, arm: Arm) -> Solver:
    """An action space, told the pose and the redundancy that the start has."""
    space = make_arm_space(kind, arm)
    assert isinstance(space, PoseSpace)
    redundancy = space.redundancy_along(arm.home[None])[0]
    return lambda pose, seed: space.solve(pose, redundancy, seed).q
