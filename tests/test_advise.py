"""``er-il advise`` for presets, URDFs and datasets, and what it refuses."""

import json
import sys
from pathlib import Path

import pytest
from chains import write_chain
from documented import documented, run
from foreign import write_swing

from er_il import Arm
from er_il.cli import main

PANDA = Arm.preset("panda")


@pytest.fixture
def advise(one_worker, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    def advised(*arguments: object) -> str:
        monkeypatch.setattr(sys, "argv", ["er-il", "advise", *map(str, arguments)])
        main()
        return capsys.readouterr().out.replace("\n", " ")

    return advised


@pytest.mark.slow
def test_a_dataset_is_advised_for_its_demonstrations_then_encoded(advise, tmp_path):
    write_swing(tmp_path / "my_robot", [f"{joint}.pos" for joint in PANDA.joints])
    said = advise(*documented("docs/choosing.md", "er-il advise my_robot")[1:])
    report = json.loads(Path("outputs/advice.json").read_text())
    assert list(report["demos"]) == ["my_robot"]
    fitness = {each["joints"][0]: each for each in report["demos"]["my_robot"]}
    assert fitness["panda_joint1"]["configurations"] == 50
    assert report["recommended"][0] in ("panda_joint1", "panda_joint3")
    assert fitness["panda_joint2"]["folds"] >= 1  # its elbow passes the highest point
    assert fitness["panda_joint4"]["risk"] > 0.9
    assert "of the steps of my_robot" in said
    assert "redundancy lies among the joints that twist" in said
    assert Path("outputs/advice.png").read_bytes()[:4] == b"\x89PNG"
    run("er-il", *documented("docs/choosing.md", "er-il encode my_robot --to erj"))
    run("er-il", *documented("docs/choosing.md", "er-il verify my_robot_erj"))
    verified = json.loads(Path("outputs/my_robot_erj/report.json").read_text())
    assert verified["arms"]["panda"]["joint_error"]["p100"] < 1e-3


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["six.urdf", "--ee-frame", "tool"], "chain6 has 6 joints and so no redundancy"),
        (["six.urdf", "--ee-frame", "hand"], "has no end-effector frame 'hand'"),
        (["absent.urdf", "--ee-frame", "tool"], "There is no file absent.urdf. Presets are "),
        (["nothing_here"], "nothing_here is not a LeRobot v3 dataset"),
        (["panda", "--arm", "xarm7"], "--arm and --arms are for datasets"),
    ],
)
def test_mistakes_are_one_line(advise, capsys, tmp_path, arguments, complaint):
    write_chain(tmp_path / "six.urdf", 6)
    with pytest.raises(SystemExit) as left:
        advise(*arguments)
    assert left.value.code == 2
    assert complaint in capsys.readouterr().err


@pytest.mark.slow
def test_the_joints_of_a_urdf_by_file_are_advised(advise, tmp_path):
    write_chain(tmp_path / "my_arm.urdf", 7)
    said = advise(*documented("docs/choosing.md", "er-il advise my_arm.urdf")[1:], "--json", "a.json")
    report = json.loads(Path("a.json").read_text())
    assert report["joints"] == [f"j{i}" for i in range(1, 8)]
    assert report["demos"] == {}
    risks = {each["joints"][0]: each["risk"] for each in report["workspace"]}
    assert report["recommended"] == [min(risks, key=lambda joint: risks[joint])]
    assert f"Command {report['recommended'][0]}: {min(risks.values()):.1%} of the workspace" in said


def test_a_dataset_that_does_not_know_its_arm_must_be_told(advise, capsys, tmp_path):
    write_swing(tmp_path / "my_robot")
    with pytest.raises(SystemExit):
        advise("my_robot")
    assert "give --arm, and --joints" in capsys.readouterr().err
