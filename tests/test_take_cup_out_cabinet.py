"""Take Cup Out Cabinet: a cup that stands in a turned cabinet, and must be held outside."""

import numpy as np
import pytest

from sim_tasks.tasks.take_cup_out_cabinet import CABINET, CUP, GOAL, REACHED, TakeCupOutCabinet

TURNED = 20, 13, 38  # seeds of episodes whose cabinet is turned to the right, to the left and hardly


@pytest.fixture
def world() -> TakeCupOutCabinet:
    return TakeCupOutCabinet()


def turn(world: TakeCupOutCabinet) -> float:
    """Turn [deg] of the cabinet."""
    inwards = world.rotation(CABINET)[:, 0]
    return float(np.degrees(np.arctan2(inwards[1], inwards[0])))


def test_the_cup_stands_still_in_the_cabinet_however_it_is_turned(world: TakeCupOutCabinet) -> None:
    turns = []
    for seed in TURNED:
        world.reset(seed=seed)
        turns.append(turn(world))
        start = world.object_pose(CUP)
        for _ in range(20):  # 1 s
            world.step(np.append(world.nominal_start, 1.0))
        assert world.object_pose(CUP) == pytest.approx(start, abs=5e-4)
        inside = (world.position(CUP) - world.position(CABINET)) @ world.rotation(CABINET)
        assert abs(inside[0]) < world.cabinet.depth / 2 and abs(inside[1]) < world.cabinet.inner_width / 2
        goal = (world.position(GOAL) - world.position(CABINET)) @ world.rotation(CABINET)
        assert goal[0] + REACHED < -world.cabinet.depth / 2, "the goal is before the opening"
    assert turns[0] > 80 and turns[1] < -80 and abs(turns[2]) < 10


def test_a_cup_at_the_goal_counts_only_while_it_is_held(world: TakeCupOutCabinet) -> None:
    world.reset(seed=0, options={"beyond_success": True})
    for action in world.leader(0):
        _, reward, _, _, info = world.step(action)
    assert info["is_success"] and reward == 1.0
    for _ in range(10):
        _, reward, _, _, info = world.step(np.append(action[:-1], 1.0))
    assert not info["is_success"] and reward < 0.125
    assert info["reward_terms"]["take"] == 0.0


def test_a_hand_that_stays_open_takes_nothing_and_a_grasp_inside_is_no_success(world: TakeCupOutCabinet) -> None:
    world.reset(seed=0)
    actions = list(world.leader(0))
    world.reset(seed=0)
    terms = [world.step(np.append(action[:-1], 1.0))[4]["reward_terms"] for action in actions]
    assert max(term["take"] + term["success"] for term in terms) == 0.0
    world.reset(seed=0)
    for action in actions:
        info = world.step(action)[4]
        if world.grasped:
            break
    assert info["reward_terms"]["reach"] == world.reward.weights["reach"]
    assert 0 < info["reward_terms"]["take"] < 0.7 * world.reward.weights["take"]
    assert info["reward_terms"]["success"] == 0.0


def test_the_cabinet_stops_the_arm_and_ends_nothing(world: TakeCupOutCabinet) -> None:
    world.reset(seed=38)
    cabinet = world.object_pose(CABINET)
    for action in world.leader(38):
        if action[-1] < 0.5:  # at the cup
            break
        world.step(action)
    for _ in range(20):  # the whole arm turns to the left, by what would be 30 cm at the hand
        _, _, terminated, _, info = world.step(np.append(action[0] + 0.5, [*action[1:-1], 1.0]))
    assert not terminated and info["failure"] == ""
    assert world.tip[1] < world.cabinet.inner_width / 2
    assert world.object_pose(CABINET) == pytest.approx(cabinet)
