"""The studies of invalid actions and of ERJ's joints: what they measure, say and write."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from documented import documented

from er_il import Arm, Status
from er_il.cli import main
from er_il.control.commander import Commander
from er_il.datasets.joint_paths import JointPath
from er_il.experiments.studies.elbow_angle import elbow_speed
from er_il.experiments.studies.prediction import predict, read_training
from er_il.experiments.studies.validity import SIZES, Condition, measure, study_validity
from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from er_il.report.joints import notes
from er_il.spaces.joint_choice import choices
from er_il.spaces.registry import make_arm_space
from er_il.support.errors import DatasetError

PANDA = Arm.preset("panda")


def run(monkeypatch, *arguments: object) -> None:
    monkeypatch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


def near_home(count: int) -> np.ndarray:
    return PANDA.home + np.random.default_rng(0).uniform(-0.2, 0.2, (count, 7))


@pytest.mark.parametrize(("space", "mode"), [("task", "delta"), ("erj", "absolute"), ("era", "delta")])
def test_larger_actions_are_more_often_invalid(space, mode):
    states = near_home(40)
    conditions = [Condition(space, mode, "demos", True, size) for size in (SIZES[0], SIZES[2], SIZES[-1])]
    actions = [measure(condition, PANDA, states) for condition in conditions]
    invalid = [int((each["status"] != Status.OK).sum()) for each in actions]
    assert [len(each) for each in actions] == [40] * 3
    assert invalid == sorted(invalid)
    assert invalid[0] < 4
    assert invalid[-1] > 20
    again = measure(conditions[1], PANDA, states)
    assert again.drop(columns="latency").equals(actions[1].drop(columns="latency"))


@pytest.mark.parametrize(("space", "dimensions"), [("task", (6, 7)), ("erj", (7, 8)), ("era", (7, 8))])
def test_every_number_of_an_action_changes_and_those_of_the_pose_alike_in_all_spaces(monkeypatch, space, dimensions):
    """Delta actions within their size, absolute ones by a normal error of it."""
    states, seen = near_home(30), []
    command = Commander.command
    monkeypatch.setattr(Commander, "command", lambda self, action, q: seen.append(action) or command(self, action, q))

    def changes(name: str, mode: str) -> np.ndarray:
        seen.clear()
        measure(Condition(name, mode, "demos", True, SIZES[1]), PANDA, states)
        meant = [np.zeros_like(seen[0]) if mode == "delta" else make_arm_space(name, PANDA).encode(q) for q in states]
        return np.array(seen[-len(states) :]) - meant

    for mode, dimension in zip(("delta", "absolute"), dimensions, strict=True):
        found = changes(space, mode)
        assert found.shape == (30, dimension)
        assert np.all(found.std(axis=0) > 0.3 * SIZES[1])
        np.testing.assert_array_equal(found[:, :3], changes("task", mode)[:, :3])
    assert np.abs(changes(space, "delta")[:, :3]).max() <= SIZES[1]
    assert np.abs(changes(space, "delta")[:, 3:]).max() <= 3 * SIZES[1]


def test_causes_are_told_apart():
    """Small changes of a stretched arm leave its reach, of an arm at its limits its limits, and large ones jump."""
    stretched = np.array([0.0, 0.6, 0.0, -0.08, 0.0, 1.6, 0.8])
    at_limit = PANDA.home.copy()
    at_limit[5] = PANDA.upper[5] - 0.01

    def causes(q: np.ndarray, size: float) -> dict[str, int]:
        actions = measure(Condition("erj", "delta", "random", True, size), PANDA, np.tile(q, (60, 1)))
        return actions["status"].value_counts().reindex([each.value for each in Status], fill_value=0).to_dict()

    out, limited, far = causes(stretched, 0.05), causes(at_limit, 0.02), causes(PANDA.home, 0.2)
    assert out["unreachable"] > 30 > out["limit"] > out["jump"]
    assert limited["limit"] > 20 > limited["unreachable"] == limited["jump"] == 0
    assert far["jump"] > 2 * (far["unreachable"] + far["limit"]) > 0


def test_all_spaces_get_the_same_states_and_errors_and_the_report_adds_up():
    told = []
    path = JointPath(0, near_home(10), near_home(10))
    report = study_validity(PANDA, {"swing": [path]}, 1, 1, lambda done, total: told.append((done, total)))
    report = json.loads(json.dumps(report))
    assert told[-1] == (len(report["cells"]), len(report["cells"])) == (160, 160)
    assert len(report["pooled"]) == 32 and "size" not in report["pooled"][0]
    assert sum(row["actions"] for row in report["pooled"]) == sum(cell["actions"] for cell in report["cells"]) == 160
    for row in report["pooled"]:
        assert sum(row["causes"].values()) == row["invalid"]
    assert [finding.split()[0] for finding in report["findings"]] == ["Around", "Around", "Without", "Decode"]
    assert "(paper 13 ms)" in report["findings"][-1]


def fitness(joint: str, risk: float, self_motion: float = 0.3) -> dict:
    return {
        "joints": [joint],
        "risk": risk,
        "self_motion": self_motion,
        "missed": 0.02,
        "smallest_p05": 0.03,
        "folds": 0,
    }


def joint_report(**changes) -> dict:
    joints = ("j1", "j2", "j3")
    workspace = [fitness("j1", 0.2, 0.4), fitness("j2", 0.6, 0.1), fitness("j3", 0.3, 0.5)]
    report = {
        "arm": "arm",
        "joints": list(joints),
        "twisting": ["j1", "j3"],
        "default": ["j1"],
        "recommended": ["j1"],
        "ranking": [["j1"], ["j3"], ["j2"]],
        "workspace": workspace,
        "demos": {"reach": [fitness("j1", 0.0), fitness("j2", 0.7), fitness("j3", 0.1)]},
        "near_singularity": [],
        "settings": {"singular": 0.02},
    }
    return report | changes


def test_what_is_said_follows_from_the_numbers():
    said = " ".join(notes(joint_report()))
    assert "Command j1: 0.0% of the steps of reach" in said
    assert "redundancy lies among the joints that twist, j1, j3" in said
    assert "Unsuitable here: j2 (70%)" in said
    assert "No demonstration comes near a singularity" in said
    near = [{"demos": "reach", "episode": 3, "first": 4, "last": 9, "smallest": 0.01}]
    mixed = [fitness("j1", 0.2, 0.1), fitness("j2", 0.6, 0.4), fitness("j3", 0.3, 0.5)]
    said = " ".join(notes(joint_report(near_singularity=near, workspace=mixed, default=["j3"])))
    assert "reach episode 3, steps 4 to 9" in said
    assert "among the joints that twist" not in said
    assert "ask for erj@j1" in said
    crossed = notes(
        joint_report(demos={"reach": [fitness("j1", 0.0) | {"folds": 1.5}, fitness("j2", 0.7), fitness("j3", 0.1)]})
    )
    assert any("crosses 1.5 of its folds" in note for note in crossed)
    many = [{**near[0], "episode": i} for i in range(7)]
    (listed,) = [note for note in notes(joint_report(near_singularity=many)) if note.startswith("Singularities near")]
    assert "episode 4" in listed and "episode 5" not in listed and "and 2 more" in listed
    (first, *_) = notes(joint_report(demos={}))
    assert first == "Command j1: 20.0% of the workspace is near a singularity; 30.0% with the next best choice, j3."


def cells(*successes: int) -> list[dict]:
    return [
        {"task": "reach", "decoder": decoder, "successes": count, "episodes": 50, "interval": [count / 50 - 0.1, 1.0]}
        for decoder, count in zip(("erj", "erj@j2", "erj@j3"), successes, strict=True)
    ]


def test_the_advice_is_checked_against_training():
    (right,) = predict(joint_report(), cells(50, 3, 40))
    assert right["rank_correlation"] == pytest.approx(1.0)
    assert right["top_choice_is_best"] and right["top_choice"] == "j1"
    note = notes(joint_report(training=[right]))[-1]
    assert "the recommended choice, j1, is the best; rank correlation of low risk with success: 1.00. j1 50/50" in note
    (wrong,) = predict(joint_report(), cells(10, 50, 30))
    assert wrong["rank_correlation"] == pytest.approx(-1.0)
    assert not wrong["top_choice_is_best"] and not wrong["top_choice_within_interval_of_best"]
    (alike,) = predict(joint_report(demos={}), cells(50, 50, 50))
    assert alike["rank_correlation"] is None
    assert "success: undefined, all choices do alike" in notes(joint_report(training=[alike]))[-1]
    assert [row["risk"] for row in alike["choices"]] == [0.2, 0.6, 0.3]  # no demos of that task: the workspace


def test_training_reports_are_read_and_others_refused(tmp_path):
    path = tmp_path / "results.json"
    other = {"task": "reach", "decoder": "joint", "successes": 1, "episodes": 2, "interval": [0, 1], "more": 1}
    path.write_text(json.dumps({"cells": [*cells(1, 2, 3), other]}))
    assert [cell["decoder"] for cell in read_training(path)] == ["erj", "erj@j2", "erj@j3"]
    for text in ("{}", "[]", "no json", '{"cells": [{"task": "reach"}]}'):
        path.write_text(text)
        with pytest.raises(DatasetError, match=r"results\.json is damaged"):
            read_training(path)
    with pytest.raises(DatasetError, match="There is no"):
        read_training(tmp_path / "absent.json")


@pytest.mark.slow
@pytest.mark.usefixtures("one_worker")
def test_the_studies_run_on_recorded_demonstrations(tmp_path, monkeypatch, capsys):
    training = tmp_path / "training.json"
    rows = [
        {**cell, "task": "reach_cup", "decoder": cell["decoder"].replace("@j", "@panda_joint")}
        for cell in cells(50, 3, 9)
    ]
    training.write_text(json.dumps({"cells": rows}))
    monkeypatch.chdir(tmp_path)
    study_joints = documented("docs/choosing.md", "er-il study joints")
    run(monkeypatch, *study_joints, "--episodes", 1, "--training", training, "--out", "joints")
    report = json.loads((tmp_path / "joints/report.json").read_text())
    assert report["recommended"] == ["panda_joint1"]
    assert len(report["workspace"]) == len(report["demos"]["reach_cup"]) == len(choices(PANDA))
    assert report["training"][0]["top_choice_is_best"]
    assert report["meta"]["versions"]["placo"]
    assert "redundancy lies among the joints that twist" in capsys.readouterr().out.replace("\n", " ")
    # The demonstrations are there already: the other studies find them where they would record them.
    for study in ("validity", "deltas", "margins", "elbow_angle"):
        shutil.copytree("joints/demos", f"{study}/demos")
    study_validity = documented("docs/choosing.md", "er-il study validity")
    run(monkeypatch, *study_validity, "--episodes", 1, "--samples", 1, "--out", "validity")
    study_deltas = documented("docs/choosing.md", "er-il study deltas")
    run(monkeypatch, *study_deltas, "--episodes", 1, "--out", "deltas")
    drifts = {each["space"]: each for each in json.loads(Path("deltas/report.json").read_text())["drifts"]}
    assert max(drifts[space]["joints"] for space in ("joint", "erj", "era", "erx")) < 1e-3 < drifts["task"]["joints"]
    assert max(each["position"] for each in drifts.values()) < 1e-4
    assert not any(each["invalid"] for each in drifts.values())
    study_elbow_angle = documented("docs/choosing.md", "er-il study elbow_angle")
    run(monkeypatch, *study_elbow_angle, "--episodes", 1, "--out", "elbow_angle")
    erj, era, stereo = json.loads(Path("elbow_angle/report.json").read_text())["elbow_angles"]
    assert [each["space"] for each in (erj, era, stereo)] == ["erj", "era", "era@stereo"]
    assert erj["near_singular"] == 0 < 0.9 * era["elbow_still"] < era["near_singular"]
    assert era["commanded"]["joints"][1] < 0.5 < era["decoded"]["joints"][1]
    report = json.loads((tmp_path / "validity/report.json").read_text())
    assert report["meta"]["demos"] == {"reach_cup": 1}
    run(monkeypatch, *documented("docs/choosing.md", "er-il study margins"), "--episodes", 1, "--out", "margins")
    margins = {row["space"]: row for row in json.loads(Path("margins/report.json").read_text())["margins"]}
    fitted = margins.pop("erx (fitted)")
    assert fitted["smallest"] > max(row["smallest"] for row in margins.values())
    assert margins["panda_joint4"]["folds"] > 0 == fitted["folds"]
    for picture in ("joints/joints.png", "validity/validity.png", "margins/margins.png"):
        assert (tmp_path / picture).read_bytes()[:4] == b"\x89PNG"


def test_an_upright_upper_arm_leaves_the_elbow_where_it_is() -> None:
    """Its self-motion is joint 1 against joint 3; elsewhere it moves the elbow as far as inverse kinematics says."""
    kinematics = kinematics_of(PANDA)
    upright, other = PANDA.home.copy(), PANDA.home + 0.3
    upright[1] = 0.0
    still, speed = elbow_speed(kinematics, "panda_link4", np.array([upright, other]))
    assert still < 1e-9
    moved = kinematics.solve(kinematics.fk(other), other, JointAngle(PANDA, ("panda_joint1",)), [other[0] + 1e-4]).q
    way = np.linalg.norm(
        kinematics.frame_pose(moved, "panda_link4")[:3, 3] - kinematics.frame_pose(other, "panda_link4")[:3, 3]
    )
    assert speed == pytest.approx(way / np.linalg.norm(moved - other), rel=1e-2)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["validity", "reach_the_moon"], "Unknown dataset or task 'reach_the_moon'. Valid: the folder of a dataset"),
        (["validity", "--samples", "0"], "0 samples are too few"),
        (["joints", "--training", "absent.json"], "There is no absent.json"),
        (["joints", str(Path(__file__).parent)], "is not a LeRobot v3 dataset"),
    ],
)
def test_mistakes_are_one_line(monkeypatch, capsys, tmp_path, arguments, complaint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        run(monkeypatch, "study", *arguments)
    assert left.value.code == 2
    assert complaint in capsys.readouterr().err
