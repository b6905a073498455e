"""The motion of one arm as that of another: reached, given way, reported, and back."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign import ARMS, LEFT_JOINTS, NAMES, RIGHT_JOINTS, paths, write_bimanual, write_one_arm
from huggingface_hub import DatasetCard
from lerobot.datasets import LeRobotDataset
from scipy.spatial.transform import Rotation

from er_il import Arm
from er_il.cli import USER_MISTAKE, main
from er_il.datasets.dataset import Dataset
from er_il.datasets.schema import LEADER_JOINTS, STATE
from er_il.kinematics.arm_angle import STEREO, ArmAngle, wrapped
from er_il.kinematics.reach import reach, shoulder
from er_il.kinematics.solver import kinematics_of
from er_il.spaces.retargeting import Retargeting
from er_il.spaces.spec import ACTION
from er_il.support.series import stretches

pytestmark = pytest.mark.usefixtures("quiet_logging", "one_worker")

PANDA, XARM, FPS = Arm.preset("panda"), Arm.preset("xarm7"), 20.0


def er_il(patch: pytest.MonkeyPatch, *arguments: object) -> None:
    patch.setattr(sys, "argv", ["er-il", *map(str, arguments)])
    main()


@pytest.mark.parametrize("name", ["panda", "xarm7", "gen3", "openarm_v2_left"])
def test_no_configuration_is_beyond_the_reach_and_one_is_at_it(name: str) -> None:
    arm = Arm.preset(name)
    q = arm.lower + (arm.upper - arm.lower) * np.random.default_rng(1).random((20000, arm.dof))
    distances = np.linalg.norm(kinematics_of(arm).fk_batch(q)[:, :3, 3] - shoulder(arm), axis=1)
    assert 0.9 * reach(arm) < distances.max() <= reach(arm) + 1e-6


def test_the_shoulder_is_where_the_first_axes_meet() -> None:
    assert np.allclose(shoulder(PANDA), [0, 0, 0.333])
    assert np.allclose(shoulder(XARM), [0, 0, 0.267])
    assert reach(Arm.preset("fr3")) == reach(PANDA)  # one geometry, though other limits


def test_goals_are_the_same_pose_about_the_other_shoulder_and_the_same_arm_angle() -> None:
    (q,) = paths(PANDA, 0, (50,))
    way = Retargeting.between(PANDA, XARM)
    T, goals = kinematics_of(PANDA).fk_batch(q), way.goals(q)
    assert way.scale == reach(XARM) / reach(PANDA)
    assert np.allclose(goals[:, :3] - [0, 0, 0.267], way.scale * (T[:, :3, 3] - [0, 0, 0.333]))
    assert np.allclose(Rotation.from_quat(goals[:, 3:7]).as_matrix(), T[:, :3, :3])
    assert np.allclose(wrapped(goals[:, 7] - ArmAngle.from_home(PANDA, STEREO).wrapped(q)), 0)
    assert np.allclose(Retargeting.between(PANDA, XARM, 1.0).goals(q)[:, :3] - [0, 0, 0.267 - 0.333], T[:, :3, 3])


def test_there_and_back_is_the_same_pose_and_arm_angle() -> None:
    """Many episodes at once, and one alone, which another solver takes."""
    for episodes in (paths(PANDA, 0, (40,) * 14), paths(PANDA, 1, (40,))):
        there = Retargeting.between(PANDA, XARM)
        goals = [there.goals(q) for q in episodes]
        middle = there.follow(goals, FPS)
        assert not any(there.deviation(*each).missed.any() for each in zip(goals, middle, strict=True))
        back = Retargeting(XARM, PANDA, 1 / there.scale)
        for q, again in zip(episodes, back.follow([back.goals(q) for q in middle], FPS), strict=True):
            T, T_again = (kinematics_of(PANDA).fk_batch(each) for each in (q, again))
            angle, angle_again = (ArmAngle.from_home(PANDA, STEREO).wrapped(each) for each in (q, again))
            assert np.linalg.norm(T[:, :3, 3] - T_again[:, :3, 3], axis=1).max() < 1e-3
            assert np.abs(wrapped(angle - angle_again)).max() < 0.02


def test_the_elbow_gives_way_before_the_pose_and_the_pose_as_little_as_can_be() -> None:
    (q,) = paths(PANDA, 0, (40,))
    way = Retargeting.between(PANDA, XARM)
    goals = way.goals(q)
    goals[:, 7] += np.linspace(0.0, 2.5, 40)  # an elbow that the joint limits do not allow to the end
    (path,) = way.follow([goals], FPS)
    found = way.deviation(goals, path, FPS)
    assert found.off_elbow.any() and not found.off_elbow[0]
    assert not found.off_pose.any() and found.position.max() < 1e-4 and found.rotation.max() < 1e-3
    far = way.goals(q)
    far[:, :3] = shoulder(XARM) + np.array([1.2 * reach(XARM), 0, 0])
    (path,) = way.follow([far], FPS)
    found = way.deviation(far, path, FPS)
    assert found.off_pose.all() and not found.off_elbow.any()
    assert np.all((path >= XARM.lower) & (path <= XARM.upper))
    assert found.position[-1] > 0.19 * reach(XARM)  # no pose is nearer than the edge of what is reachable,
    assert found.position[-1] ** 2 + found.rotation[-1] ** 2 < 0.6**2  # and an end effector that turns comes near it


def test_a_path_goes_straight_on_through_a_fold() -> None:
    """The upper arm passes the upright, where ERA's two solutions meet; turning there would leave the demonstration."""
    t = np.linspace(-1, 1, 41)[:, None]
    q = np.array([0.5, 0.0, 0.4, -1.6, 0.2, 1.7, 0.8]) + t * [0.3, 0.1, -0.3, 0.1, 0.1, 0.0, 0.0]
    same = Retargeting(PANDA, PANDA, 1.0)
    walked = same._walk([same.goals(q)], q[:1], FPS)[0]
    assert np.abs(walked - q).max() < 1e-3  # 15e-3 from the frame before alone


def test_speeds_count_by_the_joints_limits() -> None:
    way = Retargeting(PANDA, PANDA, 1.0)
    q = np.tile(PANDA.home, (4, 1))
    q[2:, 3] += 1.5 * PANDA.velocity[3] / FPS
    found = way.deviation(way.goals(q), q, FPS)
    assert found.too_fast.tolist() == [False, False, True, False]
    assert np.allclose(found.speed[2], 1.5 * (np.arange(7) == 3))


def test_stretches_have_their_first_and_last_frame() -> None:
    assert stretches(np.array([True, True, False, True])) == [[0, 1], [3, 3]]
    assert stretches(np.zeros(3, dtype=bool)) == []


@pytest.fixture(scope="module")
def there(reach_cup: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Reach Cup's joint space for the xArm7, beside the way back, and their reports."""
    folder = tmp_path_factory.mktemp("retarget")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("er_il.support.workers.cpu_count", lambda: 1)
        er_il(patch, "retarget", reach_cup / "joint", "--to", "xarm7", "--out", "there", "--repo-id", "lab/there")
        er_il(patch, "retarget", "there", "--to", "panda", "--out", "back", "--against", reach_cup / "joint")
    return folder


def test_a_recorded_dataset_there_and_back(there: Path, reach_cup: Path) -> None:
    report = json.loads((there / "outputs/retarget/back/report.json").read_text())
    against = report["against"]["xarm7"]
    assert against["reached"] == against["frames"] == report["frames"] == Dataset(reach_cup / "joint").frames
    assert against["position_error"] < 1e-3 and against["arm_angle_error"] < 0.02 and against["rotation_error"] < 0.01
    again, before = (Dataset(root).vectors(ACTION) for root in (there / "back", reach_cup / "joint"))
    assert np.abs(again - before).max() < 0.01  # the very joints, through a fold


def test_the_result_is_a_dataset_of_the_other_arm(there: Path, reach_cup: Path) -> None:
    before, after = Dataset(reach_cup / "joint"), Dataset(there / "there")
    names = (*(f"{joint}.pos" for joint in XARM.joints), "gripper")
    assert after.names(ACTION) == after.names(LEADER_JOINTS) == names
    assert after.names(STATE)[:8] == names and after.names(STATE)[8:] == before.names(STATE)[8:]
    assert after.layout.parts[0].space.arm.fingerprint == XARM.fingerprint
    assert np.array_equal(after.vectors(ACTION)[:, 7], before.vectors(ACTION)[:, 7])
    assert np.array_equal(after.vectors(ACTION), after.vectors(LEADER_JOINTS))
    state = after.vectors(STATE)
    T = kinematics_of(XARM).fk_batch(state[:, :7])
    assert np.abs(T[:, :3, 3] - state[:, 8:11]).max() < 1e-5
    assert np.abs(Rotation.from_quat(state[:, 11:15]).as_matrix() - T[:, :3, :3]).max() < 1e-5
    way = Retargeting.between(PANDA, XARM)
    assert np.abs(way.goals(before.vectors(STATE)[:, :7])[:, :3] - state[:, 8:11]).max() < 1e-3
    assert not (after.root / "meta/recipe.json").exists()
    loaded = LeRobotDataset("lab/there", root=after.root, video_backend="pyav")
    assert loaded.meta.robot_type == "xarm7" and loaded[0][ACTION].shape == (8,)
    assert np.allclose(loaded.meta.stats[ACTION]["mean"], after.vectors(ACTION).mean(axis=0), atol=1e-4)


def test_the_record_and_the_card_say_where_it_is_from(there: Path) -> None:
    entry = json.loads((there / "there/meta/er_il.json").read_text())[-1]
    assert entry["source"] == "joint" and entry["retargeted"]["panda"]["to"] == "xarm7"
    card = DatasetCard.load(there / "there/README.md")
    assert card.data.get("tags") == ["LeRobot", "er_il", "joint", "xarm7"]
    assert card.text.count("https://huggingface.co/spaces/lerobot/visualize_dataset?path=lab/there") == 1
    assert "retargeted from panda to xarm7, positions about the shoulder times 0.8149" in card.text
    assert "| Pose | `link_eef` in `link_base` |" in card.text and "| 7 | `gripper` | as in the source |" in card.text
    back = DatasetCard.load(there / "back/README.md")  # another place on the hub, which nobody named
    assert "visualize_dataset" not in back.text and back.text.count("## Actions") == 1
    assert back.data.get("tags") == ["LeRobot", "er_il", "joint", "panda"]


def test_it_is_encoded_and_verified_like_any_other(there: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    er_il(monkeypatch, "encode", there / "there", "--arm", "xarm7", "--to", "erj", "--out", tmp_path / "erj")
    er_il(monkeypatch, "verify", there / "there", tmp_path / "erj", "--episodes", 0, 2, "--out", tmp_path)
    reports = [json.loads((tmp_path / name / "report.json").read_text()) for name in ("there", "erj")]
    rows = Dataset(there / "there").episodes
    assert all(each["frames"] == sum(rows[n].stop - rows[n].start for n in (0, 2)) for each in reports)
    assert reports[0]["arms"]["xarm7"]["finding"] == "" and not reports[1]["spaces"]
    spaces = reports[0]["spaces"]
    assert set(spaces) == {"task", "erj", "era", "era@stereo", "erx"}
    assert (
        spaces["era"]["xarm7"]["joint_error_unflagged"]["p100"] < 1e-3 < spaces["task"]["xarm7"]["joint_error"]["p99"]
    )
    with pytest.raises(SystemExit):
        er_il(monkeypatch, "verify", there / "there", "--episodes", 7, "--out", tmp_path / "none")
    assert "has no episode 7. Valid: 0 to 2." in capsys.readouterr().err
    with pytest.raises(SystemExit):
        er_il(monkeypatch, "encode", there / "there", "--arm", "panda", "--to", "erj", "--out", tmp_path / "wrong")
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_both_arms_of_a_robot_that_does_not_know_them(tmp_path: Path, monkeypatch) -> None:
    """A Panda and an xArm7 in mixed order and degrees become each other, in the new robot's own convention."""
    write_bimanual(tmp_path / "source")
    (tmp_path / "arms.yaml").write_text(ARMS)
    motors = [f"l{i}" for i in range(7)]
    (tmp_path / "new.yaml").write_text(
        f"left: {{arm: xarm7, joints: [{', '.join(motors)}], units: deg, offsets: [0, 0, 0, 90, 0, 0, 0]}}\n"
        "right: {arm: panda}\n"
    )
    report = tmp_path / "report"
    arguments = ("--arms", tmp_path / "arms.yaml", "--to", tmp_path / "new.yaml", "--scale", 0.8, "--report", report)
    er_il(monkeypatch, "retarget", tmp_path / "source", "--out", tmp_path / "out", *arguments)
    before, after = Dataset(tmp_path / "source"), Dataset(tmp_path / "out")
    names = list(after.names(ACTION))
    right = [f"right_{joint}.pos" for joint in PANDA.joints]
    assert [name for name in NAMES if name not in (*LEFT_JOINTS, *RIGHT_JOINTS)] == [
        name for name in names if name not in (*motors, *right)
    ]
    assert names.index(motors[0]) == names.index(motors[-1]) - 6
    for name in ("left_gripper.pos", "lift.height"):
        for column in (ACTION, STATE):
            assert np.array_equal(
                after.vectors(column)[:, after.names(column).index(name)],
                before.vectors(column)[:, before.names(column).index(name)],
            )
    assert np.array_equal(after.column("note"), before.column("note"))
    described = json.loads((report / "report.json").read_text())["arms"]
    assert (described["left"]["from"], described["left"]["to"], described["left"]["scale"]) == ("panda", "xarm7", 0.8)
    q = np.deg2rad(after.vectors(ACTION)[:, [names.index(name) for name in motors]] + [0, 0, 0, 90, 0, 0, 0])
    left = np.deg2rad(before.vectors(ACTION)[:, [NAMES.index(name) for name in LEFT_JOINTS]])
    way = Retargeting(PANDA, XARM, 0.8)
    reached = np.concatenate([~way.deviation(way.goals(left[r]), q[r]).off_pose for r in before.episodes.values()])
    counted = described["left"]["commanded"]
    assert abs(int(reached.sum()) - (counted["frames"] - counted["off_pose"])) <= 1  # rounded to float32


def test_what_is_out_of_reach_is_told_by_episode(tmp_path: Path, monkeypatch, capsys) -> None:
    write_one_arm(tmp_path / "source", PANDA, PANDA.joints)
    options = ("--from", "panda", "--to", "xarm7", "--scale", 1.7, "--report", tmp_path / "report")
    er_il(monkeypatch, "retarget", tmp_path / "source", "--out", tmp_path / "out", *options)
    report = json.loads((tmp_path / "report/report.json").read_text())
    counted = report["arms"]["panda"]["commanded"]
    assert counted["off_pose"] > 0 and counted["position_error"] > 1e-3
    told = {number: each["panda"]["commanded"] for number, each in report["by_episode"].items()}
    assert sum(each["off_pose"] for each in told.values()) == counted["off_pose"]
    for each in told.values():
        missed = sum(last - first + 1 for first, last in each["intervals"])
        assert missed == each["off_pose"] + each["off_elbow"]
    assert f"{counted['off_pose']} off the pose" in " ".join(capsys.readouterr().out.split())


def test_commands_that_cannot_work_are_one_line(there: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    write_one_arm(tmp_path / "source", PANDA, PANDA.joints)
    out = ("--out", tmp_path / "out")
    capsys.readouterr()
    for arguments, message in (
        ((tmp_path / "source", "--to", "xarm7"), "give --from, and --joints"),
        ((tmp_path / "source", "--from", "panda", "--to", "xarm"), "Unknown arm 'xarm'"),
        ((tmp_path / "source", "--from", "panda", "--to", "xarm7", "--scale", -1), "A scale is a positive number"),
        ((tmp_path / "source", "--from", "panda", "--to", "openarm_v2"), "The dataset has one arm, but --to several"),
        ((there / "there", "--from", "panda", "--to", "panda"), ""),
        ((there / "there", "--to", "panda", "--against", tmp_path / "source"), "does not say what its actions mean"),
    ):
        with pytest.raises(SystemExit) as left:
            er_il(monkeypatch, "retarget", *arguments, *out, "--report", tmp_path / "report")
        assert left.value.code == USER_MISTAKE
        error = capsys.readouterr().err.strip()
        assert message in error and len(error.splitlines()) == 1, error
    assert not (tmp_path / "out").exists()
