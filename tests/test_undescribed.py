"""``verify`` and ``view`` on datasets that nothing of er_il has touched: joints, and an arm that the user names."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign import ARMS, LENGTHS, write_bimanual, write_one_arm

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.viewer.source import read_source

pytestmark = pytest.mark.usefixtures("quiet_logging", "one_worker")

PANDA = Arm.preset("panda")
NAMES = tuple(f"motor_{i}" for i in range(1, 8))
DESCRIBED = ("--arm", "panda", "--joints", *NAMES)


def er_il(patch: pytest.MonkeyPatch, *arguments: object) -> None:
    patch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Panda's joints in degrees under names of their own, and a robot with two arms."""
    root = tmp_path_factory.mktemp("undescribed")
    write_one_arm(root / "one", PANDA, NAMES, degrees=True)
    write_bimanual(root / "two")
    (root / "arms.yaml").write_text(ARMS)
    return root


def test_sound_joints_are_tried_in_every_space(places: Path, tmp_path: Path, monkeypatch) -> None:
    er_il(monkeypatch, "verify", places / "one", *DESCRIBED, "--units", "deg", "--episodes", 2, "--out", tmp_path)
    report = json.loads((tmp_path / "report.json").read_text())
    assert (report["frames"], report["episodes"]) == (LENGTHS[2], 1)
    assert report["arms"]["panda"]["finding"] == "" and not report["broken_by_episode"]
    assert set(report["spaces"]) == {"task", "erj", "era", "era@stereo", "erx"}
    for kind, arms in report["spaces"].items():
        assert arms["panda"]["space"] == kind
        assert (arms["panda"]["joint_error_unflagged"]["p100"] < 1e-3) == (kind != "task")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((*DESCRIBED, "--units", "rad"), "wrong units: the values are degrees, not radians (--units deg)"),
        (("--arm", "xarm7", *DESCRIBED[2:], "--units", "deg"), "wrong arm: the values fit panda (--arm panda)"),
        (("--arm", "panda", "--joints", *NAMES[::-1], "--units", "deg"), "the wrong joint order"),
    ],
)
def test_joints_that_are_not_that_arms_are_told(
    places: Path, tmp_path: Path, monkeypatch, capsys, options: tuple[str, ...], message: str
) -> None:
    with pytest.raises(SystemExit) as left:
        er_il(monkeypatch, "verify", places / "one", *options, "--out", tmp_path)
    assert left.value.code
    assert message in capsys.readouterr().err
    assert json.loads((tmp_path / "report.json").read_text())["spaces"] == {}  # of such joints they say nothing


def test_several_datasets_have_a_folder_each(places: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a/one").symlink_to(places / "one")
    other = tmp_path / "a/one"
    er_il(monkeypatch, "verify", places / "one", other, *DESCRIBED, "--units", "deg", "--out", tmp_path / "out")
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == sorted(["a_one", f"{places.name}_one"])  # their names alone are the same
    capsys.readouterr()
    with pytest.raises(SystemExit) as left:
        er_il(monkeypatch, "verify", places / "one", other, *DESCRIBED, "--out", tmp_path / "rad")
    assert left.value.code and len(list((tmp_path / "rad").glob("*/report.json"))) == 2
    assert {str(places / "one"), str(other)} <= set(capsys.readouterr().err.replace(": ", " ").split())


def test_the_arm_is_shown_at_the_joints_that_were_measured(places: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    er_il(monkeypatch, "view", places / "one", *DESCRIBED, "--units", "deg", "--save", tmp_path / "one.rrd")
    assert (tmp_path / "one.rrd").stat().st_size > 1000
    two = ("view", places / "two", "--arms", places / "arms.yaml")
    er_il(monkeypatch, *two, "--arm", "right", "--save", tmp_path / "two.rrd")
    capsys.readouterr()
    for arguments, message in (
        (("view", places / "one"), "give --arm, and --joints"),
        (two, "choose one with --arm. Valid: left, right."),
        ((*two, "--arm", "middle"), "Unknown arm 'middle'"),
    ):
        with pytest.raises(SystemExit) as left:
            er_il(monkeypatch, *arguments, "--save", tmp_path / "none.rrd")
        assert left.value.code == USER_MISTAKE
        error = capsys.readouterr().err.strip()
        assert message in error and len(error.splitlines()) == 1


def test_what_is_shown_are_the_urdfs_angles(places: Path) -> None:
    from er_il.datasets.dataset import Dataset
    from er_il.datasets.wiring import Wiring

    trace, shapes = read_source(places / "one", 1, "", [Wiring(arm="panda", joints=NAMES, units="deg")])
    rows = Dataset(places / "one").episodes[1]
    recorded = Dataset(places / "one").vectors("observation.state")[rows, :7]
    assert np.allclose(trace.q, np.deg2rad(recorded), atol=1e-6) and not shapes
    assert set(trace.status) == {"ok"}
