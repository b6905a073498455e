"""The pictures and the page of the tasks show today's worlds; cameras see objects where they are."""

import runpy
from itertools import pairwise
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from documented import ROOT, documented
from PIL import Image

from er_il.datasets.recipe import Recipe
from sim_tasks import BIMANUAL_TASKS, RL_TASKS, TASKS, TaskEntry
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.placement import Area
from sim_tasks.tasks.robot_task import RATE, RobotTask

BLOCK = 10  # [px] side of the blocks in which pictures are compared
SAME = 14  # largest mean difference of a block between a picture and its compressed copy; an object moved by 2 cm: 20
IMAGE = 128  # [px] side of a camera's image
INTERVALS = ("speed_range", "closing_range", "other_range", "others_range", "mark_height_range")  # no sides
ALL = (*TASKS, *RL_TASKS, *BIMANUAL_TASKS)
FAR_AWAY = (-50.0, 0.0, 0.0)  # x, y [m], yaw, where no camera sees it


def render_tasks() -> dict:
    (script,) = documented("docs/add_a_task.md", "python docs/render_tasks.py")
    return runpy.run_path(str(ROOT / script))


def moments(path: Path) -> list[np.ndarray]:
    """The pictures (H, W, 3) of a row."""
    row = np.asarray(Image.open(path).convert("RGB")).astype(float)
    return [row[:, left : left + 300] for left in range(0, row.shape[1], 304)]


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Mean absolute difference of two pictures, in the block where it is largest."""
    height, width = (length // BLOCK for length in one.shape[:2])
    error = np.abs(one.astype(float) - other).mean(axis=2)[: height * BLOCK, : width * BLOCK]
    return float(error.reshape(height, BLOCK, width, BLOCK).mean(axis=(1, 3)).max())


@pytest.mark.parametrize("entry", ALL)
def test_the_published_picture_starts_as_the_world_of_today(entry: TaskEntry):
    script = render_tasks()
    published = moments(script["PICTURES"] / f"{entry.task}.webp")
    env = gymnasium.make(entry.id, render_mode="rgb_array")
    env.reset(seed=script["SEED"])
    start = np.asarray(script["row"]([env.render()]))
    env.close()
    assert difference(start, published[0]) < SAME
    assert difference(published[0], published[-1]) > 2 * SAME
    # A short demonstration rests for a good part of its time, at the end.
    assert entry not in TASKS or all(difference(one, other) > 2 * SAME for one, other in pairwise(published))


@pytest.mark.slow
def test_the_pictures_of_a_task_are_those_of_its_demonstration(tmp_path: Path):
    script = render_tasks()
    script["render"]("lift_cup", tmp_path / "new" / "lift_cup.webp")
    drawn, published = moments(tmp_path / "new" / "lift_cup.webp"), moments(script["PICTURES"] / "lift_cup.webp")
    assert len(drawn) == len(published) == script["MOMENTS"]
    assert max(map(difference, drawn, published)) < SAME


@pytest.mark.parametrize(
    ("task", "camera", "name", "height"),  # [m] of the object
    [
        ("LiftCup", "wrist", "cup", 0.20),
        ("LiftCup", "shoulder", "cup", 0.20),
        ("RemoveCup", "wrist2", "cup", 0.20),
        ("RetrieveBear", "wrist", "bear", 0.16),
        ("RetrieveBear", "wrist2", "lamp", 0.31),
        ("RetrieveBear", "shoulder", "cactus", 0.33),
        ("PushButtonElbow", "shoulder", "button", 0.03),
    ],
)
def test_a_camera_sees_an_object_where_it_is(
    monkeypatch: pytest.MonkeyPatch, task: str, camera: str, name: str, height: float
):
    world = gymnasium.make(f"sim_tasks/{task}-v0", cameras=(camera,), image_size=IMAGE).unwrapped
    assert isinstance(world, ArmTask)
    image = world.reset(seed=0)[0]["pixels"][camera].astype(int)
    axis = world.object_pose(name)[:3] + np.linspace(0, height, 20)[:, None] * [0, 0, 1]
    expected = project(world, camera, axis)
    expected = expected[np.all((expected >= 0) & (expected < IMAGE), axis=1)]
    monkeypatch.setattr(type(world), "area", Area.around(FAR_AWAY[:2], (1.0, 1.0)))
    without = world.reset(seed=0, options={"state": {name: FAR_AWAY}})[0]["pixels"][camera].astype(int)
    seen = np.argwhere(np.abs(image - without).max(axis=2) > 20) + 0.5
    gaps = np.linalg.norm(expected[:, None] - seen, axis=2).min(axis=1)
    assert len(expected) > 10 and np.mean(gaps < 1.5) > 0.7, "the object is not where it should appear"
    assert seen[:, 1].mean() == pytest.approx(expected[:, 1].mean(), abs=0.05 * IMAGE)
    world.close()


def project(world: ArmTask, camera: str, points: np.ndarray) -> np.ndarray:
    """Rows and columns (K, 2) [px] at which points (K, 3) [m] of the world appear."""
    view = world.data.camera(camera)
    x, y, z = view.xmat.reshape(3, 3).T @ (points - view.xpos).T  # x right, y up, looking along -z
    focal = IMAGE / 2 / np.tan(np.radians(float(world.model.camera(camera).fovy[0])) / 2)
    return np.column_stack([IMAGE / 2 + focal * y / z, IMAGE / 2 - focal * x / z])


@pytest.mark.parametrize("entry", ALL)
def test_the_page_says_how_long_and_how_much_varies(entry: TaskEntry):
    sections = (ROOT / "docs" / "tasks.md").read_text().split("\n## ")
    (section,) = [each for each in sections if f"`{entry.task}`" in each.splitlines()[0]]
    assert f"| {entry.max_steps} steps ({entry.max_steps / RATE:g} s)" in section
    for key, sides in Recipe.load(entry.task).randomisation.items():
        if isinstance(sides, list | tuple) and key not in INTERVALS:
            assert f"{100 * sides[0]:g} × {100 * sides[1]:g} cm (`{key}`)" in section


@pytest.mark.parametrize("entry", ALL)
def test_the_page_lists_the_reward_terms_with_their_weights(entry: TaskEntry):
    world = gymnasium.make(entry.id).unwrapped
    assert isinstance(world, RobotTask)
    sections = (ROOT / "docs" / "tasks.md").read_text().split("\n## ")
    (section,) = [each for each in sections if f"`{entry.task}`" in each.splitlines()[0]]
    (row,) = [line for line in section.splitlines() if line.startswith("| Reward terms |")]
    assert (
        row
        == f"| Reward terms | {', '.join(f'`{name}` {weight:g}' for name, weight in world.reward.weights.items())} |"
    )
