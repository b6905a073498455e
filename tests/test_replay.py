import json
from pathlib import Path

import numpy as np
import pytest
from rich.progress import Progress

from er_il.datasets.dataset import Dataset
from er_il.datasets.hub import find_datasets
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import DatasetRecord, read_episodes
from er_il.datasets.recording import generate
from er_il.envs.decoders import decoder
from er_il.envs.tasks import task_id
from er_il.envs.wrapper import make_action_space_env
from er_il.evaluation.replay import replay, replay_demo, write_report
from er_il.support.errors import DatasetError

_UNSPECIFIED = {"codebase_version": "v3.0", "fps": 20, "total_frames": 1, "total_episodes": 1}
_UNSPECIFIED |= {"features": {"action": {"dtype": "float32", "shape": [1]}}}
RECIPE = Recipe.load("reach_cup").replaced(disturbance=0.0).resized(2)


@pytest.fixture(scope="module")
def datasets(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "reach_cup"
    return generate(RECIPE, ["joint", "task", "erj"], out, Progress(disable=True), workers=1).paths


@pytest.mark.slow
def test_joint_and_erj_repeat_the_demo_and_task_space_loses_the_elbow(datasets, tmp_path):
    seen = []
    DatasetRecord(RECIPE, {1: "collision"}).write(datasets["erj"])  # as if the leader had failed once
    cells = replay(list(datasets.values()), 1, lambda path, name, done, total: seen.append((path.name, name, done)))
    by_name = {cell.decoder: cell for cell in cells}
    assert list(by_name) == ["joint", "task-nearest", "task-posture", "task-clear", "erj"]
    assert by_name["joint"].successes == by_name["erj"].successes == 2
    assert max(demo.deviation for demo in by_name["joint"].demos) < 1e-6  # the same commands: the same motion
    assert max(demo.deviation for demo in by_name["erj"].demos) < 1e-2
    assert min(demo.deviation for demo in by_name["task-nearest"].demos) > 0.05
    assert by_name["task-nearest"].successes == 0
    assert ("erj", "erj", 2) in seen
    write_report(cells, {"datasets": 3}, tmp_path / "out" / "report.json")
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["meta"] == {"datasets": 3}
    cell = report["cells"][4]
    assert (cell["task"], cell["decoder"], cell["successes"], cell["episodes"]) == ("reach_cup", "erj", 2, 2)
    assert cell["interval"] == pytest.approx([0.1581, 1.0], abs=1e-4)
    assert report["cells"][1]["failures"] == {"collision": 2}
    assert cell["leader"] == {"starts": 3, "dropped": {"collision": 1}}
    assert cell["rewards"]["first"] < 0.3 and cell["rewards"]["largest_fall"] < 0.01 and cell["rewards"]["last"] == 1.0
    assert report["cells"][1]["rewards"]["last"] < 0.9  # a collision
    assert report["cells"][0]["leader"] == {"starts": 2, "dropped": {}}
    assert [demo["seed"] for demo in cell["demos"]] == [demo.seed for demo in read_episodes(datasets["joint"])]


def test_a_replay_plays_the_recorded_actions_not_the_leader_s(datasets):
    demo = read_episodes(datasets["joint"])[0]
    still = np.repeat(demo.leader[:1], len(demo.actions), axis=0)
    world = make_action_space_env(task_id(RECIPE.task), decoder("joint"), **RECIPE.environment)
    played = replay_demo(world, type(demo)(demo.seed, still, demo.leader, demo.state))
    world.close()
    assert not played.success
    assert played.failure
    assert played.deviation > 0.5


def test_episodes_and_specification_come_back(datasets):
    episodes = read_episodes(datasets["erj"])
    assert [episode.seed for episode in episodes] == sorted({episode.seed for episode in episodes})
    for episode in episodes:
        assert episode.actions.shape == (len(episode.leader), 9)
        assert episode.leader.shape[1] == 8
    assert Dataset(datasets["erj"]).spec["space"] == "erj"


def test_finding_datasets(datasets, monkeypatch):
    folder = datasets["erj"].parent
    assert find_datasets([str(datasets["erj"])]) == [datasets["erj"]]
    assert set(find_datasets([str(folder)])) == set(datasets.values())
    (folder.parent / "datasets").symlink_to(folder.parent)
    monkeypatch.chdir(folder.parent)
    assert find_datasets(["reach_cup"])
    with pytest.raises(DatasetError, match="No dataset at sweep"):
        find_datasets(["sweep"])


def test_folders_that_are_no_dataset_of_ours(tmp_path):
    with pytest.raises(DatasetError, match=r"no meta/info\.json"):
        replay([tmp_path], 1, lambda *args: None)
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta/info.json").write_text("{")
    with pytest.raises(DatasetError, match="not valid JSON"):
        replay([tmp_path], 1, lambda *args: None)
    (tmp_path / "meta/info.json").write_text(json.dumps(_UNSPECIFIED))
    with pytest.raises(DatasetError, match="what its actions mean"):
        replay([Path(tmp_path)], 1, lambda *args: None)
