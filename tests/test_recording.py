import json
import resource
import shutil
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset
from rich.progress import Progress

from er_il.datasets.dataset import Dataset
from er_il.datasets.demos import Demo, make_world, record_demo
from er_il.datasets.integrity import check_whole
from er_il.datasets.normalisation import LEAST_DEVIATION, LEAST_ROTATION, MARGIN
from er_il.datasets.recipe import Recipe
from er_il.datasets.record import DatasetRecord
from er_il.datasets.recording import generate
from er_il.datasets.schema import DEMO_SEED, ENVIRONMENT_STATE, LEADER_JOINTS, STATE
from er_il.spaces.action_space import from_spec
from er_il.spaces.spec import ACTION, action_spec
from er_il.support.atomic_files import atomic_folder, work_folder
from er_il.support.errors import DatasetError, ErIlError, UnknownNameError

RECIPE = Recipe.load("lift_cup").resized(3)
SEEN = RECIPE.resized(2).replaced(cameras=("wrist", "shoulder"), image_size=32)


@pytest.fixture(scope="module")
def generated(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "lift_cup"
    return generate(RECIPE, ["joint", "erj"], out, Progress(disable=True), workers=2)


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "seen"
    return generate(SEEN, ["joint", "erj"], out, Progress(disable=True), workers=1)


def interrupt(*_):
    raise KeyboardInterrupt


def _load(path):
    return LeRobotDataset("er_il/test", root=path, video_backend="pyav")


def _table(path):
    return pq.read_table(path / "data/chunk-000/file-000.parquet")


def test_a_dataset_says_what_it_holds(generated):
    dataset = _load(generated.paths["erj"])
    columns, space = dataset.meta.features, from_spec(action_spec(dataset.meta.features))
    assert dataset.num_episodes == 3
    assert dataset.fps == 20
    assert dataset.meta.info.splits == {"train": "0:2", "validation": "2:3"}
    assert columns[ACTION]["names"] == list(space.names)
    assert len(columns["observation.state"]["names"]) == columns["observation.state"]["shape"][0] == 15
    assert columns["observation.environment_state"]["names"][0] == "cup.x"
    assert dataset[0]["task"] == dataset.meta.tasks.index[0] != ""
    assert [name for name in columns if name.startswith(ACTION)] == [ACTION]  # others would become policy outputs
    record = DatasetRecord.read(generated.paths["erj"])
    assert record.recipe == RECIPE
    assert record.dropped == generated.dropped
    assert generated.new == ("joint", "erj")


def test_the_actions_are_the_encoded_leader(generated):
    joint, erj = (_load(generated.paths[kind]) for kind in ("joint", "erj"))
    leader = np.stack(joint.hf_dataset[LEADER_JOINTS])
    np.testing.assert_array_equal(np.stack(joint.hf_dataset[ACTION]), leader)
    np.testing.assert_array_equal(np.stack(erj.hf_dataset[LEADER_JOINTS]), leader)
    space = from_spec(action_spec(erj.meta.features))
    actions = np.stack(erj.hf_dataset[ACTION])
    for row in (0, len(leader) // 2, len(leader) - 1):
        decoded = space.decode(actions[row], seed=leader[row, :-1] + 0.01)
        np.testing.assert_allclose(decoded.q, leader[row, :-1], atol=1e-3)
        assert decoded.gripper == pytest.approx(leader[row, -1], abs=1e-6)


@pytest.mark.parametrize("kind", ["joint", "erj"])
def test_scales_are_those_of_what_differs_between_episodes(generated, kind):
    dataset = _load(generated.paths[kind])
    poses = np.stack(dataset.hf_dataset[ENVIRONMENT_STATE])
    starts = poses[[episode["dataset_from_index"] for episode in dataset.meta.episodes]]
    low, high = (np.array(dataset.meta.stats[ENVIRONMENT_STATE][key]) for key in ("min", "max"))
    np.testing.assert_allclose(low, starts.min(axis=0) - MARGIN, rtol=1e-5)
    np.testing.assert_allclose(high, starts.max(axis=0) + MARGIN, rtol=1e-5)
    assert np.any(poses > high)  # lifted: farther than it ever stood
    state = np.stack(dataset.hf_dataset[STATE])
    deviation = np.maximum(state.std(axis=0), LEAST_DEVIATION)
    np.testing.assert_allclose(dataset.meta.stats[STATE]["std"], deviation, rtol=1e-3)
    assert np.any(state.std(axis=0) < LEAST_DEVIATION)


def test_a_rotation_that_hardly_changes_does_not_outweigh_the_way_of_the_hand(generated):
    for kind in ("joint", "erj"):
        dataset = _load(generated.paths[kind])
        recorded = np.stack(dataset.hf_dataset[ACTION]).std(axis=0)
        expected = recorded.copy()
        if kind == "erj":
            assert np.any(recorded[3:7] < LEAST_ROTATION)
            expected[3:7] = np.maximum(recorded[3:7], LEAST_ROTATION)
        np.testing.assert_allclose(dataset.meta.stats[ACTION]["std"], expected, rtol=1e-3)


def test_a_demo_seed_brings_its_world_back(generated):
    dataset = _load(generated.paths["joint"])
    start = dataset.meta.episodes[1]["dataset_from_index"]
    world = make_world(RECIPE)
    observation, _ = world.reset(seed=int(dataset[start][DEMO_SEED]))
    np.testing.assert_array_equal(dataset[start]["observation.environment_state"], observation["environment_state"])
    world.close()


def test_same_seed_same_data_whatever_the_workers_and_the_first_space(generated, tmp_path):
    again = generate(RECIPE, ["erj", "joint"], tmp_path / "again", Progress(disable=True), workers=1)
    for kind in ("joint", "erj"):
        assert _table(again.paths[kind]).equals(_table(generated.paths[kind]))
        stats = [(each.paths[kind] / "meta/stats.json").read_bytes() for each in (again, generated)]
        assert stats[0] == stats[1]
    assert not list(tmp_path.glob("*.partial*"))


def test_a_space_can_be_added_later_and_another_recipe_is_refused(generated):
    out = generated.paths["joint"].parent
    before = _table(generated.paths["joint"])
    more = generate(RECIPE, ["joint", "task"], out, Progress(disable=True), workers=1)
    assert more.new == ("task",)
    assert _table(generated.paths["joint"]).equals(before)
    assert _table(more.paths["task"]).column(LEADER_JOINTS).equals(before.column(LEADER_JOINTS))
    assert generate(RECIPE, ["task"], out, Progress(disable=True), workers=1).new == ()
    with pytest.raises(DatasetError, match=r"another recipe's data; asked for is seed 5 instead of 0\."):
        generate(RECIPE.replaced(seed=5), ["joint"], out, Progress(disable=True), workers=1)


def test_a_killed_run_resumes_with_what_it_had(generated, tmp_path):
    out = tmp_path / "lift_cup"
    command = [sys.executable, "-c", "from er_il.cli import main; main()", "generate", "lift_cup"]
    demos = tmp_path / "lift_cup.partial" / "demos"
    with subprocess.Popen([*command, "--episodes", "3", "--spaces", "joint", "--out", str(out)]) as run:
        while run.poll() is None and not list(demos.glob("*.npz")):
            time.sleep(0.01)
        run.kill()
    assert not out.exists()  # nothing half-written under the final name
    finished = sorted(demos.glob("*.npz"))
    demo = Demo.load(finished[0])
    marked = replace(demo, environment_state=demo.environment_state + 7)  # recognisable, should it be recorded again
    marked.save(finished[0])
    resumed = generate(RECIPE, ["joint"], out, Progress(disable=True), workers=1)
    ours, theirs = _table(resumed.paths["joint"]), _table(generated.paths["joint"])
    assert ours.drop(["observation.environment_state"]).equals(theirs.drop(["observation.environment_state"]))
    rows = ours.column(DEMO_SEED).to_numpy() == demo.seed
    column = [np.stack(table.column("observation.environment_state").to_numpy()) for table in (ours, theirs)]
    np.testing.assert_array_equal(column[0][rows], column[1][rows] + 7)
    np.testing.assert_array_equal(column[0][~rows], column[1][~rows])
    assert not (tmp_path / "lift_cup.partial").exists()


def test_an_interrupted_run_gives_the_same_files(seen, tmp_path, monkeypatch):
    ask, whole, resumed = Progress(disable=True), seen.paths["erj"].parent, tmp_path / "resumed"
    with monkeypatch.context() as patch:
        patch.setattr("er_il.datasets.writer.normalise_observations", interrupt)
        with pytest.raises(KeyboardInterrupt):
            generate(SEEN, ["joint", "erj"], resumed, ask, workers=1)
    generate(SEEN, ["joint", "erj"], resumed, ask, workers=1)
    files = {path.relative_to(whole) for path in whole.rglob("*") if path.is_file()}
    assert {path.relative_to(resumed) for path in resumed.rglob("*") if path.is_file()} == files
    for name in (file for file in files if file.parts[1] != "data"):  # whose files hold a fingerprint that is drawn
        assert (resumed / name).read_bytes() == (whole / name).read_bytes(), name
    assert all(_table(whole / space).equals(_table(resumed / space)) for space in ("joint", "erj"))


def test_a_run_that_was_killed_while_encoding_resumes(generated, tmp_path):
    out = tmp_path / "lift_cup"
    shutil.copytree(generated.paths["joint"], out / "joint")
    for partial in (out / "erj.partial", out / "erj.partial" / "erj"):  # as version 0.1.0 left it, and as this one does
        shutil.copytree(generated.paths["joint"], partial)
        (partial / "meta/stats.json").unlink()
    (tmp_path / "lift_cup.partial").mkdir()
    (tmp_path / "lift_cup.partial" / "recipe.partial-0123abcd.json").touch()  # killed as it wrote the recipe
    resumed = generate(RECIPE, ["joint", "erj"], out, Progress(disable=True), workers=1)
    assert resumed.new == ("erj",)
    assert _table(resumed.paths["erj"]).equals(_table(generated.paths["erj"]))
    assert sorted(path.name for path in out.iterdir()) == ["erj", "joint"]
    assert [path.name for path in tmp_path.iterdir()] == ["lift_cup"]


def test_one_run_at_a_time(generated, tmp_path):
    out = tmp_path / "lift_cup"
    with work_folder(out), pytest.raises(ErIlError, match=r"Another command works in .*lift_cup\.partial"):
        generate(RECIPE, ["joint"], out, Progress(disable=True), workers=1)
    shutil.copytree(generated.paths["joint"], out / "joint")
    with atomic_folder(out / "erj") as partial:
        with pytest.raises(ErIlError, match=r"Another command works in .*erj\.partial"):
            generate(RECIPE, ["joint", "erj"], out, Progress(disable=True), workers=1)
        partial.mkdir()


def test_an_unfinished_run_of_another_recipe_is_refused(tmp_path):
    work = tmp_path / "lift_cup.partial"
    work.mkdir()
    (work / "recipe.json").write_text(json.dumps(RECIPE.replaced(seed=4).to_dict()))
    with pytest.raises(DatasetError, match="seed 0 instead of 4"):
        generate(RECIPE, ["joint"], tmp_path / "lift_cup", Progress(disable=True), workers=1)


def test_cameras_are_recorded_once_and_shared(seen):
    videos = [sorted(path.rglob("*.mp4")) for path in seen.paths.values()]
    assert len(videos[0]) == 2
    assert [video.stat().st_ino for video in videos[0]] == [video.stat().st_ino for video in videos[1]]
    dataset = _load(seen.paths["erj"])
    start = dataset.meta.episodes[1]["dataset_from_index"]
    world = make_world(SEEN)
    demo = record_demo(world, int(dataset[start][DEMO_SEED]), RECIPE.disturbance)
    world.close()
    assert isinstance(demo, Demo)
    for step in (0, 40, len(demo) - 1):  # video frames belong to their rows, in the second episode too
        for camera in SEEN.cameras:
            decoded = dataset[start + step][f"observation.images.{camera}"].numpy().transpose(1, 2, 0) * 255
            error = [np.abs(decoded - demo.images[camera][near]).mean() for near in (step, (step + 60) % len(demo))]
            assert error[0] < 10
            assert error[0] < error[1]


def test_a_video_that_is_cut_or_overwritten_is_told(seen, tmp_path):
    check_whole(Dataset(seen.paths["erj"]))
    for name, spoil in {
        "cut": lambda video: video[: len(video) // 2],
        "zeros": lambda video: bytes(len(video)),
    }.items():
        root = shutil.copytree(seen.paths["erj"], tmp_path / name)
        video = next(root.rglob("*.mp4"))
        good = video.read_bytes()
        video.unlink()  # its content is shared
        video.write_bytes(spoil(good))
        with pytest.raises(DatasetError, match=f"The video .*{video.name} is damaged"):
            check_whole(Dataset(root))


def test_wrong_requests(tmp_path):
    ask = Progress(disable=True)
    with pytest.raises(UnknownNameError, match="action space 'polar'"):
        generate(RECIPE, ["polar"], tmp_path / "out", ask, workers=1)
    with pytest.raises(UnknownNameError, match="action space"):
        generate(RECIPE, [], tmp_path / "out", ask, workers=1)
    with pytest.raises(UnknownNameError, match="camera 'elbow'"):
        generate(RECIPE.replaced(cameras=("elbow",)), ["joint"], tmp_path / "out", ask, workers=1)
    (tmp_path / "file").write_text("")
    with pytest.raises(DatasetError, match=r"Cannot write to .*file/out: Not a directory"):
        generate(RECIPE, ["joint"], tmp_path / "file" / "out", ask, workers=1)
    (tmp_path / "strange" / "joint").mkdir(parents=True)
    with pytest.raises(DatasetError, match=r"not a dataset of er-il generate: it has no meta.recipe\.json"):
        generate(RECIPE, ["joint"], tmp_path / "strange", ask, workers=1)


def test_a_full_folder_is_one_clear_error(tmp_path):
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))  # no file may grow longer, as on a full disk
    try:
        with pytest.raises(DatasetError, match=r"Cannot write to .*out: File too large"):
            generate(RECIPE, ["joint"], tmp_path / "out", Progress(disable=True), workers=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not (tmp_path / "out").exists()


def test_lerobot_s_own_viewer_shows_it_headless(generated, tmp_path):
    from lerobot.scripts.lerobot_dataset_viz import visualize_dataset

    dataset = LeRobotDataset("er_il/test", root=generated.paths["erj"], episodes=[1], video_backend="pyav")
    saved = visualize_dataset(dataset, 1, save=True, output_dir=tmp_path)
    assert saved is not None
    assert saved.stat().st_size > 10_000
