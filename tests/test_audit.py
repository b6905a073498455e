"""``er-il audit``: what elbows did is measured, and the recommendation follows."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from documented import documented
from elbows import paths_with_elbows
from foreign import ARMS, write_bimanual

from er_il import Arm
from er_il.cli import main
from er_il.datasets.joint_paths import JointPath
from er_il.evaluation.elbow_spread import elbow_spread
from er_il.evaluation.task_drift import HOME, NEAREST, arm_points, task_drift
from er_il.experiments.studies.audit import study_audit
from er_il.kinematics.self_motion import extents
from er_il.kinematics.solver import kinematics_of
from er_il.report.audit import recommendation

PANDA = Arm.preset("panda")


@pytest.fixture(scope="module")
def shown() -> list[np.ndarray]:
    return paths_with_elbows(PANDA, [1.2, 1.2, 1.2, 1.2])


def audited(paths: list[np.ndarray]) -> dict:
    steps: list[tuple[int, int]] = []
    report = study_audit(
        PANDA, [JointPath(i, path, path) for i, path in enumerate(paths)], 20, 1, lambda *done: steps.append(done)
    )
    assert steps[-1][0] == steps[-1][1] == len(steps)
    return json.loads(json.dumps(report, allow_nan=False))


def test_an_elbow_that_follows_the_hand_needs_no_action():
    report = audited(paths_with_elbows(PANDA, [0, 0, 0, 0]))
    assert report["verdict"]["case"] == "task_enough"
    assert report["verdict"]["decoder"] == NEAREST
    assert report["drift"][NEAREST]["elbow_m"]["p100"] < 1e-3
    assert recommendation(report).startswith("Task is enough.")


def test_an_elbow_that_moves_by_itself_in_the_same_way_was_demonstrated(shown):
    report = audited(shown)
    assert report["verdict"]["case"] == "demonstrated"
    assert report["drift"][NEAREST]["elbow_m"]["p100"] > 0.1
    assert report["drift"][NEAREST]["followed"] == 1.0
    assert report["spread"]["given_pose"]["open"] < 0.05
    assert report["verdict"]["odd_episodes"] == []
    rows = {row["space"]: row for row in report["spaces"]}
    assert rows[report["verdict"]["space"]]["smallest"] >= 0.1
    assert len(rows["panda_joint1"]["curve"]) == sum(map(len, shown))
    assert rows["panda_joint4"]["near"] > 0.5 and rows["panda_joint4"]["stretches"] >= 1


def test_elbows_that_disagree_are_told_with_the_odd_episode():
    report = audited(paths_with_elbows(PANDA, [1.2, 1.2, 1.2, -1.2]))
    assert report["verdict"]["case"] == "arbitrary"
    assert report["verdict"]["odd_episodes"] == [3]
    said = recommendation(report)
    assert "then task is enough" in said
    assert "Episode 3 holds the elbow differently" in said


def test_one_episode_cannot_tell_consistency(shown):
    assert audited(shown[:1])["verdict"]["case"] == "unknown"


def test_the_spread_is_that_of_the_elbows():
    """Of two elbows, the estimate of the standard deviation is their difference by the root of two."""
    kinematics, q = kinematics_of(PANDA), PANDA.home
    ends = [q, kinematics.solve(kinematics.fk(q), q + 0.4 * _self_motion(q)).q]
    spread = elbow_spread(PANDA, [np.tile(end, (5, 1)) for end in ends])
    found = spread.deviation(timed=True)
    assert found is not None
    angle, distance = found
    gap = np.linalg.norm(ends[1] - ends[0])
    moved = np.linalg.norm(np.subtract(*(arm_points(PANDA, end[None])[0] for end in ends)), axis=1).max()
    assert angle == pytest.approx(gap / np.sqrt(2), rel=0.05)
    assert distance == pytest.approx(moved / np.sqrt(2), rel=0.1)
    assert spread.covered == 1.0


def test_self_motion_ends_at_a_limit():
    q = PANDA.home
    (width,) = extents(kinematics_of(PANDA), q)
    moved = kinematics_of(PANDA).solve(kinematics_of(PANDA).fk(q), q + 0.3 * _self_motion(q)).q
    assert extents(kinematics_of(PANDA), moved)[0] == pytest.approx(width, abs=0.11)  # the same way, from elsewhere
    assert width > 4.0


def test_a_posture_takes_the_elbow_there(shown):
    drift = task_drift(PANDA, HOME, shown)
    space = kinematics_of(PANDA)
    for path, decoded in zip(shown, drift.paths, strict=True):
        np.testing.assert_allclose(space.fk_batch(decoded)[:, :3, 3], space.fk_batch(path)[:, :3, 3], atol=2e-4)
        assert np.abs(decoded[-1] - PANDA.home).max() < np.abs(path[10] - PANDA.home).max()


def _self_motion(q: np.ndarray) -> np.ndarray:
    return np.linalg.svd(kinematics_of(PANDA).jacobian(q))[2][-1]


@pytest.fixture
def audit(one_worker, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> str:
        monkeypatch.setattr(sys, "argv", ["er-il", "audit", *map(str, arguments)])
        main()
        return capsys.readouterr().out.replace("\n", " ")

    return run


@pytest.mark.slow
def test_both_arms_of_a_dataset_get_a_page(audit, tmp_path):
    write_bimanual(tmp_path / "my_robot")
    Path("arms.yaml").write_text(ARMS)
    said = audit(*documented("docs/audit.md", "er-il audit my_robot --arms")[1:], "--episodes", 1)
    report = json.loads(Path("outputs/audit/my_robot/report.json").read_text())
    assert list(report["arms"]) == ["left", "right"]
    for label in ("left", "right"):
        page = Path(f"outputs/audit/my_robot/{label}_README.md").read_text()
        assert f"{label}_README.md" in said
        assert "nothing can be compared" in page
        for name in ("elbow", "folds"):
            assert Path(f"outputs/audit/my_robot/{label}_{name}.png").read_bytes()[:4] == b"\x89PNG"
            assert f"{label}_{name}.png" in page
        assert "{{" not in page and "None" not in page


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["nothing_here"], "nothing_here is not a LeRobot v3 dataset"),
        (["nothing_here", "--episodes", "0"], "at least one is needed"),
    ],
)
def test_mistakes_are_one_line(audit, capsys, arguments, complaint):
    with pytest.raises(SystemExit) as left:
        audit(*arguments)
    assert left.value.code == 2
    assert complaint in capsys.readouterr().err
