"""Rewards: named terms that rise along a demonstration and reach their maximum with success alone."""

from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np
import pytest

import sim_tasks
from sim_tasks.tasks.arm_task import ArmTask
from sim_tasks.tasks.rewards import Reward, closeness, proximity, way_down

IDS = [entry.id for entry in (*sim_tasks.TASKS, *sim_tasks.RL_TASKS)]
SEEDS = (0, 1000, 1_000_000)
DIP = 0.02  # by which the reward may fall for a moment, since servos lag and overshoot


def make(task_id: str) -> ArmTask:
    world = gymnasium.make(task_id).unwrapped
    assert isinstance(world, ArmTask)
    return world


def play(world: ArmTask, actions: Iterable[np.ndarray]) -> tuple[np.ndarray, list[dict[str, Any]]]:
    """Rewards and infos of an episode; an episode that has succeeded goes on."""
    rewards, infos = [], []
    for action in actions:
        _, reward, terminated, truncated, info = world.step(action)
        rewards.append(reward)
        infos.append(info)
        if truncated or (terminated and not info["is_success"]):
            break
    return np.array(rewards), infos


@pytest.mark.parametrize("task_id", IDS)
def test_the_reward_rises_along_every_demonstration_to_one(task_id: str) -> None:
    world = make(task_id)
    for seed in SEEDS:
        _, start = world.reset(seed=seed, options={"beyond_success": True})
        rewards, infos = play(world, world.leader(seed))
        rewards = np.append(sum(start["reward_terms"].values()), rewards)
        assert rewards[0] < 0.6
        assert np.all(rewards > np.maximum.accumulate(rewards) - DIP)
        assert rewards[-1] == 1.0
        success = np.array([info["is_success"] for info in infos])
        assert success[-1] and np.all(rewards[1:][success] == 1.0)
        # 1 is reached with the goal, which then holds for a quarter of a second before the episode succeeds.
        assert np.argmax(rewards[1:] == 1.0) == np.argmax(success) - 4


@pytest.mark.parametrize("task_id", IDS)
def test_the_terms_are_weighted_shares_that_sum_to_the_reward(task_id: str) -> None:
    world = make(task_id)
    _, start = world.reset(seed=0, options={"beyond_success": True})
    rewards, infos = play(world, world.leader(0))
    for reward, terms in [(sum(start["reward_terms"].values()), start["reward_terms"])] + [
        (reward, info["reward_terms"]) for reward, info in zip(rewards, infos, strict=True)
    ]:
        assert terms.keys() == world.reward.weights.keys()
        assert all(0.0 <= terms[name] <= weight for name, weight in world.reward.weights.items())
        assert sum(terms.values()) == pytest.approx(reward, abs=1e-12)
    for name, weight in world.reward.weights.items():
        values = [info["reward_terms"][name] for info in infos]
        assert values[-1] == weight and min(values) < 0.7 * weight, f"{name} tells nothing"


@pytest.mark.parametrize("task_id", IDS)
def test_random_and_idle_policies_get_clearly_less(task_id: str) -> None:
    world = make(task_id)
    rng = np.random.default_rng(0)
    for seed in range(3):
        _, start = world.reset(seed=seed, options={"beyond_success": True})
        initial = sum(start["reward_terms"].values())
        idle, infos = play(world, [np.append(world.joint_positions, 1.0)] * world.max_steps)
        assert infos[-1]["failure"] in ("timeout", "not_pressed")
        assert idle.max() < initial + 0.005
        world.reset(seed=seed)
        low, high = world.action_space.low, world.action_space.high
        random, infos = play(world, (rng.uniform(low, high) for _ in range(world.max_steps)))
        assert not infos[-1]["is_success"]
        # Swung about at random, an arm may meet its goal for a moment.
        assert np.quantile(random, 0.9) < 0.8 and random.mean() < 0.3


@pytest.mark.parametrize("task_id", IDS)
def test_the_reward_depends_on_the_state_and_not_on_time(task_id: str) -> None:
    world = make(task_id)
    _, start = world.reset(seed=0, options={"beyond_success": True})
    still = np.append(world.joint_positions, 1.0)
    _, infos = play(world, [still] * 40)
    assert infos[-1]["reward_terms"] == pytest.approx(start["reward_terms"], abs=0.005)


def test_a_hand_above_the_cabinet_is_farther_from_the_cup_than_one_in_the_opening() -> None:
    """The way to the cup leads through the opening: a straight line through the ceiling is none."""
    world = make("sim_tasks/ReachCup-v0")
    world.reset(seed=0)
    stem = world.grasp_point
    above, opening = stem + np.array([0.0, 0.0, 0.30]), np.array([0.42, 0.0, stem[2]])
    distances = [world._distance_to_grasp(hand) for hand in (above, opening)]
    assert np.linalg.norm(above - stem) == pytest.approx(np.linalg.norm(opening - stem), abs=0.02)
    assert distances[0] > 2 * distances[1]
    # Continuous through the opening.
    near = [world._distance_to_grasp(opening + np.array([dx, 0.05, 0.0])) for dx in (-1e-6, 1e-6)]
    assert near[0] == pytest.approx(near[1], abs=1e-5)


def test_a_reward_is_declared_with_weights_that_sum_to_one_and_success() -> None:
    reward = Reward(reach=0.5, success=0.5)
    assert reward.terms({"reach": 0.5}, success=False) == {"reach": 0.25, "success": 0.0}
    assert reward.terms({"reach": 7.0}, success=True) == {"reach": 0.5, "success": 0.5}
    assert reward.terms({"reach": -1.0}, success=False) == {"reach": 0.0, "success": 0.0}
    for wrong in ({"reach": 0.5, "success": 0.4}, {"reach": 1.0}, {"reach": 1.5, "success": -0.5}):
        with pytest.raises(ValueError, match="sum to 1 and include 'success'"):
            Reward(**wrong)
    assert proximity(-0.1, 0.2) == 1.0 and proximity(0.2, 0.2) == pytest.approx(np.exp(-1))
    assert closeness(-0.1, 0.2) == 1.0 and closeness(0.2, 0.2) == pytest.approx(np.exp([-0.25, -1, -5]).mean())


def test_the_way_down_to_a_place_leads_over_its_edge() -> None:
    def way(across: float, above: float) -> float:
        return way_down(np.array([0.6 * across, -0.8 * across, -above]))

    assert way(0.0, 0.0) == 0.0
    assert way(0.0, 0.3) == pytest.approx(0.3)  # straight above: down
    assert way(0.05, 0.05) == pytest.approx(0.05) and way(0.4, 0.1) == pytest.approx(0.4)  # the cone, and beyond
    assert way(0.4, -0.05) == pytest.approx(0.55)  # on the bench, lower than the place: first up
    assert way(0.05, 0.0) > way(0.05, 0.04)  # against the furniture under the place: up, too
    assert way(0.02, 0.0) == pytest.approx(0.04)  # never shorter than the straight way
