"""The end effector on a circle: in task space the elbow drifts, in the ER spaces it does not."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from figures import assert_readable, points
from lerobot.model import RobotKinematics

from er_il import Arm
from er_il.arms.urdf import generated_urdf
from er_il.cli import main
from er_il.experiments.studies.circle import LAPS, POSES, RADIUS, drive_all, study_circle, targets
from er_il.report.circle import circle_figure
from er_il.report.tables import markdown_table
from er_il.report.text import table
from er_il.support.errors import ArmError

PANDA = Arm.preset("panda")


def test_the_elbow_drifts_in_task_space_and_returns_in_er_spaces():
    drives = {drive["solver"]: drive for drive in study_circle(PANDA)["drives"]}
    assert set(drives) == {"lerobot", "task", "erj", "era"}
    for solver in ("lerobot", "task"):
        assert np.all(np.diff(drives[solver]["drift"]) > 0.05)
        assert drives[solver]["drift"][-1] > 0.3
    for solver in ("erj", "era"):
        assert max(drives[solver]["drift"]) < 1e-4
        assert np.ptp(drives[solver]["elbow"], axis=0).max() > 0.1  # it does move on the way
    for drive in drives.values():  # all of them follow the circle, or the comparison would say nothing
        assert drive["max_position_error"] < 1e-3
        assert drive["max_rotation_error"] < 1e-3


def test_lerobots_solver_is_used_as_its_users_use_it():
    solver = RobotKinematics(str(generated_urdf(PANDA.model_xml, "panda.urdf")), PANDA.ee_frame, list(PANDA.joints))
    degrees = np.rad2deg(PANDA.home)
    solver.forward_kinematics(degrees)
    for pose in targets(PANDA)[: 2 * POSES]:
        degrees = solver.inverse_kinematics(degrees, pose)
    np.testing.assert_allclose(drive_all(PANDA)["lerobot"][2 * POSES], np.deg2rad(degrees), atol=1e-5)


def test_the_command_writes_what_it_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(sys, "argv", ["er-il", "circle", "--out", str(tmp_path / "new")])
    main()
    report = json.loads((tmp_path / "new" / "report.json").read_text())
    assert report["meta"]["versions"]["lerobot"]
    assert [len(drive["drift"]) for drive in report["drives"]] == [LAPS] * 4
    assert (tmp_path / "new" / "circle.png").read_bytes()[:4] == b"\x89PNG"
    shown = capsys.readouterr().out
    for drive, line in zip(report["drives"], markdown_table(table("drift", **report)).splitlines()[2:], strict=True):
        drift = f"{100 * drive['drift'][-1]:.1f}"
        assert drift in shown
        assert f"| {drift} cm | " in line
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["circle.png", "report.json"]


def test_the_figure_shows_the_arm_after_each_lap_and_the_drift():
    report = study_circle(PANDA)
    figure = circle_figure({**report, "meta": report["meta"] | {"versions": {"lerobot": "1.2.3"}}})
    by_lerobot, by_erj, chart = figure.axes
    drives = {drive["solver"]: drive for drive in report["drives"]}
    for axis, solver in ((by_lerobot, "lerobot"), (by_erj, "erj")):
        lines = [np.array(line.get_data_3d()).T for line in axis.lines]
        arms = [line for line in lines if len(line) == PANDA.dof + 2]
        np.testing.assert_allclose(arms, drives[solver]["links"])
        elbows = [line[0] for line in lines if len(line) == 1]
        ends = np.linalg.norm(np.array(elbows[1:]) - elbows[0], axis=1)
        np.testing.assert_allclose(ends[1:], drives[solver]["drift"], atol=1e-4)
        circle = lines[-1][:, :2]
        np.testing.assert_allclose(np.linalg.norm(circle - circle.mean(axis=0), axis=1), RADIUS, atol=1e-4)
    for label, solver in (("LeRobot's IK", "lerobot"), ("er_il, task space", "task"), ("er_il, ERJ", "erj")):
        np.testing.assert_allclose(points(chart)[label][1:], 100 * np.array(drives[solver]["drift"]))
    shown = [text.get_text() for text in figure.texts]
    assert "LeRobot 1.2.3's IK" in shown
    assert f"elbow drift after {LAPS} laps: {100 * drives['lerobot']['drift'][-1]:.1f} cm" in shown
    (legend,) = figure.legends
    assert len(legend.get_texts()) == LAPS + 2
    assert_readable(figure)


def test_an_arm_without_an_elbow_is_refused():
    with pytest.raises(ArmError, match="no elbow to watch"):
        study_circle(Arm.preset("panda8"))
