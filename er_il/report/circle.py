"""The elbow on a circle: the arm after each lap by two solvers, and the elbow's drift of all, from the report alone."""

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d import Axes3D

from er_il.report.charts import curve_chart
from er_il.report.style import BLUE, DASHED, LOOKS, RED, Look, styled
from er_il.report.text import Report

# Dashes show what lies below.
LOOKS_OF = {
    "lerobot": Look("LeRobot's IK", RED),
    "task": Look("er_il, task space", LOOKS["joint"].colour, DASHED),
    "era": Look("er_il, ERA", LOOKS["era"].colour),
    "erj": Look("er_il, ERJ", LOOKS["erj"].colour, DASHED),
}


@styled
def circle_figure(report: Report) -> Figure:
    """The arm at the end of each lap for LeRobot's solver and for ERJ, and the elbow's drift of all solvers."""
    drives = {drive["solver"]: drive for drive in report["drives"]}
    laps = report["meta"]["laps"]
    colours = mpl.colormaps["inferno_r"](np.linspace(0.25, 0.85, laps + 1))  # the start first
    figure = Figure(figsize=(11.5, 4.3))
    figure.set_layout_engine("none")  # every part has its place
    titles = {"lerobot": f"LeRobot {report['meta']['versions']['lerobot']}'s IK", "erj": "ERJ"}
    for column, (solver, title) in enumerate(titles.items()):
        axis = figure.add_axes((0.32 * column - 0.02, 0.0, 0.36, 0.98), projection="3d")
        assert isinstance(axis, Axes3D)
        _draw_arm(axis, drives[solver], report["meta"]["circle"], colours)
        figure.text(0.32 * column + 0.02, 0.93, title, fontsize=13, fontweight="bold")
        drift = f"elbow drift after {laps} laps: {100 * drives[solver]['drift'][-1]:.1f} cm"
        figure.text(0.32 * column + 0.02, 0.875, drift, fontsize=10)
    handles = [Line2D([], [], color=BLUE, linewidth=2, label="end-effector path")]
    names = ["start", *(f"lap {lap}" for lap in range(1, laps + 1))]
    handles += [Line2D([], [], color=c, marker="o", linewidth=3, label=n) for c, n in zip(colours, names, strict=True)]
    figure.legend(handles=handles, ncols=len(handles), loc="lower left", columnspacing=1.2, handlelength=1.4)
    chart = figure.add_axes((0.72, 0.2, 0.27, 0.62))
    drifts = pd.DataFrame({solver: [0.0, *drive["drift"]] for solver, drive in drives.items()})
    data = (100 * drifts).rename_axis("x").reset_index().melt("x", var_name="series")
    curve_chart(chart, data, LOOKS_OF)
    chart.set(xlabel="Laps", ylim=(-1, None), title="Elbow drift [cm]")
    chart.legend(loc="upper left")
    return figure


def _draw_arm(axis: Axes3D, drive: Report, circle: list[list[float]], colours: np.ndarray) -> None:
    links, elbow = np.array(drive["links"]), np.array(drive["elbow"])
    lap_poses = (len(elbow) - 1) // (len(links) - 1)
    for lap, colour in enumerate(colours):
        axis.plot(*links[lap].T, color=colour, linewidth=3.5, solid_capstyle="round")
        axis.plot(*elbow[lap * lap_poses, :, None], "o", color=colour, markersize=8, markeredgecolor="white")
        axis.plot(*elbow[max(0, lap - 1) * lap_poses : lap * lap_poses + 1].T, color=colour, linewidth=1)
    axis.plot(*np.array(circle).T, color=BLUE, linewidth=2)
    axis.set(xlim=(-0.15, 0.65), ylim=(-0.5, 0.3), zlim=(0, 0.8))
    axis.set_box_aspect((1, 1, 1), zoom=1.3)
    axis.view_init(elev=26, azim=-40)
    axis.set_axis_off()
