"""Take Bottle Out Fridge: the door must be opened with the bottle held still, and then stays open."""

import gymnasium
import numpy as np
import pytest
from playing import play_on

from sim_tasks.tasks.take_bottle_out_fridge import BOTTLE, OPEN, TakeBottleOutFridge

CLOSED, WIDE = 0.0, 1.0  # openings of the gripper


def make() -> TakeBottleOutFridge:
    world = gymnasium.make("sim_tasks/TakeBottleOutFridge-v0").unwrapped
    assert isinstance(world, TakeBottleOutFridge)
    return world


def demonstration(world: TakeBottleOutFridge) -> np.ndarray:
    world.reset(seed=0, options={"beyond_success": True})
    return np.array(list(world.leader(0)))


def test_the_hand_starts_around_the_neck_and_the_door_leans_on_the_arm() -> None:
    world = make()
    for seed in range(10):
        world.reset(seed=seed)
        assert world.tip[:2] == pytest.approx(world.position(BOTTLE)[:2], abs=0.012)
        assert np.radians(25) < world.door_angle < np.radians(38)
        still = np.append(world.joint_positions, WIDE)
        before, bottle = world.door_angle, world.position(BOTTLE).copy()
        info = play_on(world, [still] * 20)
        assert world.door_angle == pytest.approx(before, abs=0.03)  # nor does it push the arm away
        assert world.joint_positions == pytest.approx(still[:-1], abs=0.003)
        assert world.position(BOTTLE) == pytest.approx(bottle, abs=0.003)
        assert sum(info["reward_terms"].values()) == 0.0


def test_the_door_stays_open_once_it_was_opened_with_the_bottle_held_still() -> None:
    world = make()
    actions = demonstration(world)
    widest = 0.0
    for action in actions:
        info = world.step(action)[4]
        widest = max(widest, world.door_angle)
        assert world.opened == (info["reward_terms"]["door"] == world.reward.weights["door"])
        assert world.opened or widest < OPEN + 0.05
    assert info["is_success"]
    play_on(world, [actions[-1]] * 40)
    assert world.door_angle > OPEN - 0.01
    world.reset(seed=0)  # the next episode's door closes again
    play_on(world, [np.append(world.joint_positions, WIDE)] * 20)
    assert not world.opened and world.door_angle < OPEN - 0.1


def test_a_door_opened_without_the_bottle_falls_shut_again() -> None:
    world = make()
    actions = demonstration(world)
    actions[:, -1] = WIDE
    play_on(world, actions)
    assert not world.opened
    assert world.door_angle < np.radians(20)


def test_a_bottle_moved_before_earns_less_and_comes_out_in_vain() -> None:
    world = make()
    actions = demonstration(world)
    grasped = np.append(world.joint_positions, CLOSED)
    held = play_on(world, [grasped] * 8)["reward_terms"]
    assert held["grasp"] == world.reward.weights["grasp"] and held["door"] > 0.0
    out = np.linspace(grasped, actions[-1], 60)  # past the door, which leans on the arm
    info = play_on(world, [*out, *[actions[-1]] * 20])
    assert world.grasped and not world.opened and not info["is_success"]
    assert 0.0 < info["reward_terms"]["door"] < held["door"] / 2  # the way back is worth it
    assert all(info["reward_terms"][later] == 0.0 for later in ("pull", "out", "success"))


def test_the_way_is_paid_straight_out_of_the_fridge_then_to_the_mark() -> None:
    world = make()
    actions = demonstration(world)
    rows = []
    for action in actions:
        terms = world.step(action)[4]["reward_terms"]
        if world.opened:
            left = world.ways["mark"]
            assert not world.ways["place"].any()  # an open door shows in what is observed
            rows.append((terms["pull"], terms["out"], -left[0], -left[1], np.linalg.norm(left)))
    pull, out, before, aside, away = np.array(rows).T  # [m] of the last three: behind the mark, to its left, from it
    assert pull[0] == pytest.approx(0.0, abs=0.002) and pull[-1] == world.reward.weights["pull"]
    assert out[-1] == world.reward.weights["out"]
    straight = aside > 0.3  # the bottle comes out of the fridge before it goes to the side
    assert np.ptp(pull[straight]) > 5 * np.ptp(out[straight])
    assert np.corrcoef(pull[straight], before[straight])[0, 1] < -0.999
    outside, complete = pull == pull[-1], out == out[-1]
    assert not out[~outside].any() and out[outside][0] < 0.25 * out[-1]
    assert np.corrcoef(out[outside & ~complete], away[outside & ~complete])[0, 1] < -0.999  # every step on is paid


def test_a_bottle_let_go_outside_is_not_taken() -> None:
    world = make()
    actions = demonstration(world)
    assert play_on(world, actions)["is_success"]
    loose = np.append(actions[-1][:-1], WIDE)
    for steps in (1, 20):
        info = play_on(world, [loose] * steps)
        assert not world.grasped and world.opened
        assert not info["is_success"] and sum(info["reward_terms"].values()) == 0.0
