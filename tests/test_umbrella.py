"""Take Umbrella Out of Stand: the stand holds the umbrella, and only a held one is taken out."""

import gymnasium
import mujoco
import numpy as np
import pytest

import sim_tasks  # noqa: F401
from sim_tasks.tasks.take_umbrella_out_of_stand import STAND, UMBRELLA_NAME, TakeUmbrellaOutOfStand


def make() -> TakeUmbrellaOutOfStand:
    world = gymnasium.make("sim_tasks/TakeUmbrellaOutOfStand-v0").unwrapped
    assert isinstance(world, TakeUmbrellaOutOfStand)
    world.reset(seed=0, options={"beyond_success": True})
    return world


def depth(world: TakeUmbrellaOutOfStand) -> float:
    """How deep [m] the umbrella's tip is below the stand's rim."""
    return float(world.position(STAND)[2] + world.stand.height - world.position(UMBRELLA_NAME)[2])


def test_the_umbrella_stands_by_itself() -> None:
    world = make()
    before = world.handle.copy()
    for _ in range(40):
        world.step(np.append(world.joint_positions, 1.0))
    assert np.linalg.norm(world.handle - before) < 0.002


def test_pulled_aside_it_leans_in_the_stand_and_stays_there() -> None:
    world = make()
    deep = depth(world)
    body = world.model.body(UMBRELLA_NAME).id
    for force in ((4.0, 0.0, 0.0), (0.0, -4.0, 0.0)):  # [N], more than its weight, at its middle
        world.data.xfrc_applied[body, :3] = force
        for _ in range(100):
            mujoco.mj_step(world.model, world.data)
        lean = np.arccos(world.rotation(UMBRELLA_NAME)[2, 2])
        assert np.radians(0.5) < lean < np.radians(10)
        assert depth(world) > deep - 0.01
    assert not world._succeeds()


def test_only_a_held_umbrella_whose_tip_has_left_the_stand_is_out() -> None:
    world = make()
    world.data.joint(UMBRELLA_NAME).qpos[2] += depth(world) + 0.01
    mujoco.mj_forward(world.model, world.data)
    assert depth(world) < 0 and not world._succeeds()
    assert world._progress()["lift"] == 0.0
    world.reset(seed=0, options={"beyond_success": True})
    *actions, last = world.leader(0)
    for action in actions:
        world.step(action)
        assert world._succeeds() == (world.grasped and depth(world) < 0.0)
    assert world._succeeds() and world._progress() == {"reach": 1.0, "lift": 1.0}
    # Let go, it is out no more, and the grasp counts no more.
    *_, info = world.step(np.append(last[:-1], 1.0))
    assert not world.grasped and not world._succeeds()
    assert info["reward_terms"]["lift"] == info["reward_terms"]["success"] == 0.0
    assert info["reward_terms"]["reach"] == pytest.approx(0.125, abs=0.0156)
