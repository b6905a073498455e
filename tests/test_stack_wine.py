"""Stack Wine: what counts as a bottle in the rack, and what the rack does with one."""

import gymnasium
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sim_tasks  # noqa: F401
from sim_tasks.tasks.object_task import WIDTH
from sim_tasks.tasks.rewards import closeness
from sim_tasks.tasks.stack_wine import BOTTLE, NEAR, RACK, StackWine
from sim_tasks.world.wine_rack import SEAT


def make(arm: str = "panda") -> StackWine:
    world = gymnasium.make("sim_tasks/StackWine-v0", arm=arm).unwrapped
    assert isinstance(world, StackWine)
    world.reset(seed=0)
    return world


def lay(world: StackWine, offset: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: float = 0.0) -> None:
    """Put the bottle into the rack, off its place by an offset [m] and a turn [rad] about the vertical."""
    rack = Rotation.from_matrix(world.rotation(RACK))
    bottle = rack * Rotation.from_euler("ZY", (turn, np.pi / 2))
    foot = world.seat + rack.apply(offset) - bottle.apply((0.0, 0.0, SEAT))
    x, y, z, w = bottle.as_quat()
    world.data.joint(BOTTLE).qpos = (*foot, w, x, y, z)
    world.data.joint(BOTTLE).qvel = 0.0
    mujoco.mj_forward(world.model, world.data)


def wait(world: StackWine, seconds: float) -> None:
    still = np.append(world.joint_positions, 1.0)
    for _ in range(round(seconds * world.rate)):
        world.step(still)


def test_a_bottle_on_its_place_is_in_the_rack_and_no_other_is() -> None:
    world = make()
    assert not world._succeeds()
    lay(world)
    assert world._succeeds()
    assert world._progress() == {"reach": 1.0, "stack": 1.0}
    lay(world, turn=np.pi)  # the foot where the neck belongs
    assert not world._succeeds()
    lay(world, offset=(0.0, 0.0, 1.5 * NEAR))
    assert not world._succeeds()
    lay(world, turn=0.3)
    assert not world._succeeds()


def test_the_rack_centres_a_bottle_that_is_let_go_and_keeps_it() -> None:
    for offset in ((0.0, 0.0, 0.0), (0.0, 0.008, 0.018), (0.01, -0.008, 0.015)):
        world = make()
        lay(world, offset)
        wait(world, 1.5)
        distance, angle = world._errors()
        assert distance < 0.015 and angle < 0.05
        assert np.abs(world.data.joint(BOTTLE).qvel).max() < 0.05


def test_a_bottle_that_is_not_held_is_worth_the_way_to_it() -> None:
    world = make()
    distance = np.linalg.norm(world.tip - world.grasp_point)
    assert world._progress() == pytest.approx({"reach": closeness(distance, WIDTH), "stack": 0.0})
    lay(world, offset=(0.0, 0.0, 0.05))  # in the air above its place
    assert world._progress()["stack"] == 0.0


def test_a_taller_arm_stacks_too() -> None:
    world = make("panda8")
    info: dict = {}
    for action in world.leader(0):
        *_, terminated, _, info = world.step(action)
        if terminated:
            break
    assert info["is_success"]
