"""The layout of a recording: world and cameras on the left, curves on the right, statuses below."""

from collections.abc import Sequence

import rerun.blueprint as rrb

from er_il.viewer.arm import ARM
from er_il.viewer.curves import ACTION, END_EFFECTOR, GROUPS, JOINTS, PATH, REDUNDANCY, STATUS, Curve
from er_il.viewer.world import CAMERAS, SCENE

ABOUT = "about"
TIME, FRAME = "time", "frame"
TITLES = {JOINTS: "Joints", END_EFFECTOR: "End effector", REDUNDANCY: "Redundancy", ACTION: "Action"}
MAX_COLUMNS = 3
# Seen from the front right, above the table.
EYE, TARGET = (1.4, -1.4, 1.3), (0.3, 0.0, 0.4)  # [m] in the arm's base frame


def blueprint(curves: Sequence[Curve], cameras: Sequence[str]) -> rrb.Blueprint:
    """Lay out a recording that has those curves and cameras."""
    world = rrb.Spatial3DView(
        origin="/",
        contents=[f"+ /{name}/**" for name in (ARM, SCENE, PATH)],
        name="World",
        eye_controls=rrb.EyeControls3D(position=EYE, look_target=TARGET, eye_up=(0, 0, 1)),
    )
    pictures = [rrb.Spatial2DView(origin=f"/{CAMERAS}/{camera}", name=camera) for camera in cameras]
    tabs = [_grid(group, [curve for curve in curves if curve.group == group]) for group in GROUPS]
    about = rrb.TextDocumentView(origin=f"/{ABOUT}", name="About")
    left = rrb.Vertical(world, rrb.Horizontal(*pictures), row_shares=[2, 1]) if pictures else world
    right = rrb.Vertical(
        rrb.Tabs(*[tab for tab in tabs if tab is not None], about),
        rrb.StateTimelineView(origin=f"/{STATUS}", name="Status of each decode"),
        row_shares=[5, 1],
    )
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[5, 6]),
        rrb.TimePanel(state="collapsed", timeline=TIME),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def _grid(group: str, curves: Sequence[Curve]) -> rrb.Grid | None:
    if not curves:
        return None
    plots = [
        rrb.TimeSeriesView(
            origin=f"/{curve.path}",
            name=f"{curve.name} [{curve.unit}]" if curve.unit else curve.name,
            # The colours mean the same in every plot, and a legend hides the curve below it.
            plot_legend=rrb.PlotLegend(visible=curve is curves[0]),
        )
        for curve in curves
    ]
    return rrb.Grid(
        *plots, grid_columns=1 if len(plots) == 1 else 2 if len(plots) <= 4 else MAX_COLUMNS, name=TITLES[group]
    )
