"""The tasks that end with a thing at its place and nothing in the hand: what counts as there, and letting go."""

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim_tasks.tasks.phone_on_base import PHONE, PhoneOnBase
from sim_tasks.tasks.put_rubbish_in_bin import BIN, HIGH, RUBBISH, TOMATOES, PutRubbishInBin
from sim_tasks.tasks.release_task import ReleaseTask
from sim_tasks.world.rubbish import PAPER_MIDDLE

HELD = {"PutRubbishInBin": 0.375, "PhoneOnBase": 0.3125}  # reward of a thing that is there, in a closed hand
WORLDS = tuple(HELD)


def make(name: str) -> Any:
    world = gymnasium.make(f"sim_tasks/{name}-v0").unwrapped
    assert isinstance(world, ReleaseTask)
    return world


def put(world: ReleaseTask, name: str, position: np.ndarray, rotation: np.ndarray) -> None:
    """Put a thing anywhere, and let the world go on for a second."""
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    world.data.joint(name).qpos = (*position, w, x, y, z)
    world.data.joint(name).qvel = 0.0
    rest(world)


def rest(world: ReleaseTask, opening: float = 1.0) -> tuple[float, dict[str, Any]]:
    """Reward and info once the arm has stood still for a second."""
    q = world.data.ctrl[world.robot.actuators].copy()
    reward, info = 0.0, {}
    for _ in range(20):
        _, reward, _, _, info = world.step(np.append(q, opening))
    return reward, info


def play(world: ReleaseTask, actions: Iterable[np.ndarray]) -> None:
    for action in actions:
        world.step(action)


@pytest.mark.parametrize("name", WORLDS)
def test_what_is_there_but_in_the_hand_is_no_success_until_the_fingers_open(name: str) -> None:
    world = make(name)
    world.reset(seed=0, options={"beyond_success": True})
    actions = list(world.leader(0))
    release = np.flatnonzero([action[-1] == 0.0 for action in actions])[-1]
    play(world, actions[: release + 1])
    reward, info = rest(world, opening=0.0)
    assert world.grasped and world._in_place() and not info["is_success"]
    assert reward == pytest.approx(HELD[name])  # all but opening the hand, and success
    reward, _ = rest(world, opening=0.4)
    assert reward == pytest.approx(HELD[name] + 0.25 * 0.4)  # an action nearer to opening is worth more
    assert world.grasped and world.data.ctrl[world.robot.gripper] == 0.0  # but the fingers are open or closed
    reward, info = rest(world)
    assert not world.grasped and info["is_success"] and reward == 1.0


@pytest.mark.parametrize("name", WORLDS)
def test_fingers_around_a_thing_do_not_sink_into_it(name: str) -> None:
    world = make(name)
    world.reset(seed=0)
    actions = list(world.leader(0))
    closed = next(i for i, action in enumerate(actions) if action[-1] == 0.0)
    play(world, actions[: closed + 8])
    width = 0.046 if isinstance(world, PhoneOnBase) else 0.056
    assert world.grasped and abs(0.08 * world.gripper_opening - width) < 0.003


def test_rubbish_counts_in_the_bin_and_not_beside_it_and_tomatoes_never_do() -> None:
    world = make("PutRubbishInBin")
    assert isinstance(world, PutRubbishInBin)
    world.reset(seed=0, options={"beyond_success": True})
    bin_, level = world.position(BIN).copy(), np.eye(3)
    put(world, TOMATOES[0], bin_ + np.array([0.0, 0.0, 0.05]), level)
    assert not world._in_place()
    put(world, RUBBISH, bin_ + np.array([0.18, 0.0, 0.0]), level)
    assert not world._in_place()
    put(world, RUBBISH, bin_ + np.array([0.05, 0.03, world.bin.height + 0.05]), level)  # falls in
    assert world._in_place() and rest(world)[1]["is_success"]


def test_the_way_of_the_rubbish_leads_over_the_bin_before_it_leads_down() -> None:
    world = make("PutRubbishInBin")
    assert isinstance(world, PutRubbishInBin)
    world.reset(seed=0)
    world._attachment.held = RUBBISH
    progress = []
    for offset in ((0.0, -0.30, 0.0), (0.0, -0.05, 0.0), (0.0, -0.02, 0.0), (0.0, 0.0, -0.10)):
        world.data.body(RUBBISH).xpos[:] = world.above_rim(HIGH) + offset - (0.0, 0.0, PAPER_MIDDLE)
        world.data.body(RUBBISH).xmat[:] = np.eye(3).ravel()
        progress.append(world._progress())
    far, near, over, low = progress
    assert far["carry"] < near["carry"] < over["carry"] == 1.0
    assert far["lower"] == near["lower"] == 0.0 < over["lower"] < low["lower"] == 1.0
    assert far["open"] == near["open"] == 0.0 and over["open"] == low["open"] == 1.0  # as it is told to be


def test_a_phone_counts_in_the_cradle_and_not_across_it_or_upside_down() -> None:
    world = make("PhoneOnBase")
    assert isinstance(world, PhoneOnBase)
    world.reset(seed=0, options={"beyond_success": True})
    rest_pose = world.rest
    position, rotation = rest_pose[:3, 3], rest_pose[:3, :3]
    for turn in (Rotation.from_euler("z", 90, degrees=True), Rotation.from_euler("z", 180, degrees=True)):
        put(world, PHONE, position + 0.01 * rotation[:, 2], rotation @ turn.as_matrix())
        assert not world._in_place()
    put(world, PHONE, position + 0.005 * rotation[:, 2], rotation)
    assert world._in_place() and rest(world)[1]["is_success"]
