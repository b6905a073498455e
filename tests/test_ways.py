"""What agents are told of a task: what its reward depends on, and nothing else of its things."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from playing import play_on

from er_il.envs.learning import make_rl_env
from er_il.envs.protocol import DirectedEnv
from er_il.envs.tasks import task_id
from sim_tasks import RL_TASKS

TASKS = [entry.task for entry in RL_TASKS]
# What is not gone in the end: released things lie below the hand, and the rubbish below the bin's high point.
STAYS = {"meat_off_grill": {"meat"}, "phone_on_base": {"phone"}, "put_rubbish_in_bin": {"rubbish", "bin"}}
STAYS |= {"pick_up_cup": {"moved"}, "take_bottle_out_fridge": {"place"}, "slide_cup_obstacles": {"beside"}}
STAYS |= {"serve_coffee_obstacles": {"mug", "waypoint"}, "stack_wine": {"bottle"}}
LEFT = 0.1  # [m or rad] at most, where success has a tolerance


def make(task: str) -> Any:
    return gymnasium.make(task_id(task), rate=10).unwrapped


@pytest.mark.parametrize("task", TASKS)
def test_of_a_tasks_ways_nothing_is_left_once_the_leader_has_done_it(task: str) -> None:
    world = make(task)
    assert isinstance(world, DirectedEnv)
    world.reset(seed=0, options={"beyond_success": True})
    before = {name: float(np.linalg.norm(way)) for name, way in world.ways.items()}
    info = play_on(world, list(world.leader(0)))
    assert info["is_success"] and max(before.values()) > LEFT
    after = {name: float(np.linalg.norm(way)) for name, way in world.ways.items()}
    assert after.keys() == before.keys()
    assert {name for name, left in after.items() if left > LEFT} <= STAYS.get(task, set())
    assert all(np.linalg.norm(each) == pytest.approx(1.0) for each in world.directions.values())


@pytest.mark.parametrize("task", TASKS)
def test_the_state_holds_them_by_name_and_in_order(task: str) -> None:
    env = make_rl_env(task, "erj")
    names = env.observation_names  # before the first episode
    world: Any = env.world
    for seed in (0, 1):
        state, _ = env.reset(seed=seed)
        told = dict(zip(names, state.tolist(), strict=True))
        for way, vector in world.ways.items():
            assert [told[f"{way}.d{axis}"] for axis in "xyz"] == pytest.approx(vector.tolist(), abs=1e-6)
        for direction, vector in world.directions.items():
            assert [told[f"{direction}.{axis}"] for axis in "xyz"] == pytest.approx(vector.tolist(), abs=1e-6)


@pytest.mark.parametrize(("task", "distractor"), [("put_rubbish_in_bin", "tomato_1"), ("pick_and_lift", "blue_block")])
def test_what_does_not_matter_is_not_observed(task: str, distractor: str) -> None:
    env = make_rl_env(task, "task")
    world: Any = env.world
    state, _ = env.reset(seed=0)
    elsewhere, _ = env.reset(seed=0, options={"state": {distractor: (0.3, -0.35, 0.0)}})
    assert np.linalg.norm(world.position(distractor)[:2] - (0.3, -0.35)) < 0.01
    assert np.array_equal(state, elsewhere)


def test_the_meat_is_the_one_asked_for() -> None:
    world = make("meat_off_grill")
    asked = set()
    for seed in range(6):
        world.reset(seed=seed)
        asked.add(world.asked)
        above = world.tip + world.ways["meat"] - world.position(world.asked)
        assert np.linalg.norm(above[:2]) < 1e-6
    assert len(asked) == 2


def test_a_world_without_ways_is_told_by_the_poses_of_its_objects() -> None:
    env = make_rl_env("lift_cup", "erj")
    assert not isinstance(env.world, DirectedEnv)
    state, _ = env.reset(seed=0)
    world: Any = env.world
    first = env.observation_names.index("cup.dx")
    assert state[first : first + 3] == pytest.approx(world.object_pose("cup")[:3] - world.ee_pose[:3, 3], abs=1e-6)
