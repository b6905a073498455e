"""Meat Off Grill: which piece is asked, where it is in place, and that it must be let go."""

import numpy as np
import pytest

from sim_tasks.tasks.meat_off_grill import GRILL, MEATS, ORDER, MeatOffGrill

Pose = tuple[float, float, float]


@pytest.fixture
def world() -> MeatOffGrill:
    return MeatOffGrill()


def shelf(world: MeatOffGrill, seed: int) -> Pose:
    """A place on the shelf of an episode, for a piece to be put there by hand."""
    world.reset(seed=seed)
    x, y, _ = world.point(GRILL, (*world.grill.shelf_centre, 0.0))
    return float(x), float(y), 0.0


def test_the_order_lies_under_the_asked_piece_and_tells_which_it_is(world: MeatOffGrill) -> None:
    asked = set()
    for seed in range(8):
        observation, _ = world.reset(seed=seed)
        order = world.object_pose(ORDER)
        assert np.linalg.norm(order[:2] - world.object_pose(world.asked)[:2]) < 1e-6
        blue_up = world.rotation(ORDER)[2, 2] > 0
        assert (world.asked == "steak") == blue_up
        assert observation["environment_state"][-7:] == pytest.approx(order)
        asked.add(world.asked)
    assert asked == set(MEATS)


def test_the_asked_piece_on_the_shelf_is_success_and_no_other_piece_or_place(world: MeatOffGrill) -> None:
    there = shelf(world, 0)
    (other,) = set(MEATS) - {world.asked}
    world.reset(seed=0, options={"state": {world.asked: there}})
    assert world._succeeds() and set(world._progress().values()) == {1.0}
    world.reset(seed=0, options={"state": {other: there}})
    assert not world._succeeds() and world._progress()["place"] == 0.0
    x, y, _ = there
    world.reset(seed=0, options={"state": {world.asked: (x, y - 0.15, 0.0)}})  # beyond the shelf, falling
    assert not world._succeeds() and world._progress()["place"] == 0.0


def test_a_piece_is_in_place_but_the_task_not_done_until_it_is_let_go(world: MeatOffGrill) -> None:
    world.reset(seed=0, options={"beyond_success": True})
    asked, terms = world.asked, []
    for action in world.leader(0):
        terms.append((world.step(action)[4]["reward_terms"], world.held))
    held = [term for term, thing in terms if thing == asked]
    weights = world.reward.weights
    assert held[-1]["place"] == weights["place"] and held[-1]["success"] == 0.0
    assert held[-1]["release"] < 0.8 * weights["release"]
    assert terms[-1] == (pytest.approx(weights), "")
    assert world.object_pose(asked)[2] == pytest.approx(world.grill.shelf, abs=0.002)


def test_carrying_the_wrong_piece_to_the_shelf_is_no_success(world: MeatOffGrill) -> None:
    world.reset(seed=0)
    actions, asked = list(world.leader(0)), world.asked
    world.reset(seed=0)
    (world.asked,) = set(MEATS) - {asked}
    infos = [world.step(action)[4] for action in actions]
    assert not infos[-1]["is_success"]
    assert max(info["reward_terms"]["place"] for info in infos) == 0.0
