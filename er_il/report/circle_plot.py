"""The picture of the elbow's drift: the arm after each lap, solved in two ways, and how far the elbow has moved."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D

from er_il.arms.arm import Arm
from er_il.experiments.studies.circle import LAPS, LEROBOT, NAMES, POSES, Drive, targets
from er_il.kinematics.solver import kinematics_of

ARMS = {LEROBOT: f"LeRobot {version('lerobot')}'s IK", "erj": "ERJ"}
# Colour (Okabe and Ito's, told apart by every eye) and line: dashes show what lies below.
LINES = {
    LEROBOT: ("#D55E00", "-"),
    "task": ("#56B4E9", (0, (2, 3))),
    "era": ("#CC79A7", "-"),
    "erj": ("#009E73", (0, (3, 3))),
}
HAND = "#0072B2"
LAP_COLOURS = mpl.colormaps["inferno_r"](np.linspace(0.25, 0.85, LAPS + 1))  # the start first
EYE = (26, -40)  # [deg] elevation and azimuth of the look at the arm


def plot(arm: Arm, drives: Sequence[Drive], path: Path) -> None:
    """Draw the arm at the end of each lap for LeRobot's solver and for ERJ, and the drift of all."""
    of = {drive.solver: drive for drive in drives}
    with mpl.rc_context({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(11.5, 4.3), dpi=110)
        for column, (solver, title) in enumerate(ARMS.items()):
            axis = figure.add_axes((0.32 * column - 0.02, 0.0, 0.36, 0.98), projection="3d")
            assert isinstance(axis, Axes3D)
            _draw_arm(axis, arm, of[solver])
            away = f"after {LAPS} laps the elbow is {100 * of[solver].drift[-1]:.1f} cm from its start"
            figure.text(0.32 * column + 0.02, 0.93, title, fontsize=13, fontweight="bold")
            figure.text(0.32 * column + 0.02, 0.875, away)
        laps = [Line2D([], [], color=colour, marker="o", linewidth=3) for colour in LAP_COLOURS]
        names = ["start", *(f"lap {lap}" for lap in range(1, LAPS + 1))]
        hand = Line2D([], [], color=HAND, linewidth=2)
        figure.legend(
            [hand, *laps], ["way of the hand", *names], frameon=False, fontsize=9, ncols=LAPS + 2,
            loc="lower left", bbox_to_anchor=(0.0, 0.0), columnspacing=1.2, handlelength=1.4,
        )  # fmt: skip
        chart = figure.add_axes((0.72, 0.2, 0.27, 0.62))
        for solver, (colour, style) in LINES.items():
            ends = 100 * np.concatenate([[0.0], of[solver].drift])
            label = NAMES[solver]
            chart.plot(range(LAPS + 1), ends, color=colour, linestyle=style, marker="o", markersize=4, label=label)
        chart.set(xlabel="laps", ylim=(-1, None))
        chart.set_title("Elbow's distance from its start [cm]", fontsize=10, loc="left")
        chart.legend(frameon=False, loc="upper left", fontsize=9)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _draw_arm(axis: Axes3D, arm: Arm, drive: Drive) -> None:
    kinematics = kinematics_of(arm)
    frames = (arm.base_frame, *arm.joints, arm.ee_frame)
    links = np.stack([kinematics.fk_batch(drive.q[::POSES], frame)[:, :3, 3] for frame in frames], axis=1)
    for lap, colour in enumerate(LAP_COLOURS):
        axis.plot(*links[lap].T, color=colour, linewidth=3.5, solid_capstyle="round")
        axis.plot(*drive.elbow[lap * POSES, :, None], "o", color=colour, markersize=8, markeredgecolor="white")
        axis.plot(*drive.elbow[max(0, lap - 1) * POSES : lap * POSES + 1].T, color=colour, linewidth=1)
    axis.plot(*targets(arm)[:POSES, :3, 3].T, color=HAND, linewidth=2)
    axis.set(xlim=(-0.15, 0.65), ylim=(-0.5, 0.3), zlim=(0, 0.8))
    axis.set_box_aspect((1, 1, 1), zoom=1.3)  # pyright: ignore[reportArgumentType]  its stub says int
    axis.view_init(*EYE)
    axis.set_axis_off()
