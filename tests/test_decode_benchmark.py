"""The benchmark of decoding, with few targets."""

import json
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest
from documented import ROOT, documented

from er_il.report.decode_page import write_page


def measure(out: Path) -> dict[str, Any]:
    """Run the documented command; return its report."""
    script, *options = documented("docs/speed.md", "python benchmarks/decode.py")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [script, *options, "--targets", "12", "--largest-batch", "3000", "--out", str(out)])
        runpy.run_path(str(ROOT / script), run_name="__main__")
    return json.loads((out / "report.json").read_text())


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The report, the other libraries included."""
    return measure(tmp_path_factory.mktemp("decode"))


def rows(report: dict[str, Any], solver: str, *commands: str) -> dict[str, dict[str, Any]]:
    """A solver's rows by scenario."""
    return {
        row["scenario"]: row
        for row in report["decodes"]
        if row["solver"].startswith(solver) and row["commands"] == list(commands)
    }


def test_er_il_solves_what_is_near_and_returns_the_joints(measured: dict[str, Any]) -> None:
    assert measured["meta"]["git"]
    for solver, command in (("er_il, ERJ", "panda_joint1"), ("er_il, ERA", "arm_angle")):
        found = rows(measured, solver, command)
        assert len(found) == 4
        near = found["Seed ± 0.03 rad"]
        assert near["solved"] == near["returned"] == near["targets"] == 12
        assert near["joint_error_p99_rad"] < 1e-4
        assert near["position_error_p99_m"] < 1e-4
        assert all(0.0 < row["decode_p50_ms"] <= row["decode_p99_ms"] for row in found.values())
        assert found["Seed ± 0.3 rad"]["iterations_p50"] > near["iterations_p50"] >= 1


def test_a_pose_alone_is_met_by_other_joints(measured: dict[str, Any]) -> None:
    for solver in ("er_il, task space", "Placo", "LeRobot, iterated"):
        near = rows(measured, solver)["Seed ± 0.03 rad"]
        assert near["solved"] == 12
        assert near["returned"] < 6
    once = rows(measured, "LeRobot, one call")
    assert once["Seed ± 0.3 rad"]["solved"] < once["Seed ± 0.03 rad"]["targets"]
    assert all(row["iterations_p99"] == 1 for row in once.values())


def test_other_libraries_solve_for_a_commanded_joint(measured: dict[str, Any]) -> None:
    for solver, joint in (("mink", "panda_joint1"), ("pink", "panda_joint1"), ("GeoFIK", "panda_joint7")):
        near = rows(measured, solver, joint)["Seed ± 0.03 rad"]
        assert near["solved"] == 12
        assert near["joint_error_p99_rad"] < 0.03


def test_batches_are_the_single_decodes(measured: dict[str, Any]) -> None:
    assert {row["space"] for row in measured["batches"]} == {"task", "erj", "era"}
    assert all(row["largest_difference_rad"] < 1e-6 for row in measured["batches"])
    assert all(row["solved"] == row["actions"] for row in measured["batches"])


def test_the_page_is_rendered_from_the_report(tmp_path: Path) -> None:
    folder = ROOT / "results" / "decode"
    (tmp_path / "report.json").write_bytes((folder / "report.json").read_bytes())
    write_page(tmp_path)
    assert (tmp_path / "README.md").read_text() == (folder / "README.md").read_text()
