"""Slide Cup Obstacles and Serve Coffee Obstacles: judgement, rewards and what a fixed elbow runs into."""

import numpy as np
import pytest
from playing import play

from er_il.kinematics.redundancy import JointAngle
from er_il.kinematics.solver import kinematics_of
from sim_tasks.tasks.object_task import ObjectTask
from sim_tasks.tasks.serve_coffee_obstacles import BOTTLES, MUG, TOP, ServeCoffeeObstacles
from sim_tasks.tasks.slide_cup_obstacles import CUP, FALL, FAR, MARK, SlideCupObstacles

LEANING = (np.cos(0.4), np.sin(0.4), 0.0, 0.0)  # quaternion of a turn by 0.8 rad about x
STRAIGHT = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def shelf() -> SlideCupObstacles:
    return SlideCupObstacles()


@pytest.fixture(scope="module")
def coffee() -> ServeCoffeeObstacles:
    return ServeCoffeeObstacles()


def still(world: ObjectTask, opening: float = 1.0) -> np.ndarray:
    return np.append(world.joint_positions, opening)


def put(world: ObjectTask, name: str, position: np.ndarray, quaternion: tuple[float, ...] = STRAIGHT) -> None:
    world.data.joint(name).qpos = (*position, *quaternion)
    world.data.joint(name).qvel = 0.0


def with_the_elbow_of_the_start(world: ObjectTask) -> list[np.ndarray]:
    """The demonstration's path of the hand, the base joint kept where it is."""
    world.reset(seed=0)
    kinematics, q, path = kinematics_of(world.arm), world.joint_positions, []
    fixed = JointAngle(world.arm, (world.arm.joints[0],)), [q[0]]
    for action in world.leader(0):
        q = kinematics.solve(kinematics.fk(action[:-1]), q, *fixed).q
        path.append(np.append(q, action[-1]))
    return path


def test_a_cup_counts_as_slid_only_standing_on_the_mark(shelf: SlideCupObstacles) -> None:
    for offset, quaternion, outcome in (
        ((0.0, 0.0, 0.0), STRAIGHT, "success"),
        ((0.0, -0.05, 0.0), STRAIGHT, ""),  # beside it
        ((0.0, 0.0, 0.10), STRAIGHT, ""),  # above it, at first
        ((0.0, 0.0, 0.01), LEANING, ""),
    ):
        shelf.reset(seed=0)
        put(shelf, CUP, shelf.position(MARK) + np.array(offset), quaternion)
        assert play(shelf, [still(shelf)] * (5 if outcome else 3)) == outcome


def test_a_cup_that_falls_off_the_shelf_ends_the_episode(shelf: SlideCupObstacles) -> None:
    shelf.reset(seed=0)
    put(shelf, CUP, np.array([0.85, 0.0, shelf.furniture.height - 0.5 * FALL]))
    assert play(shelf, [still(shelf)]) == ""
    assert play(shelf, [still(shelf)] * 10) == "cup_fell"


def test_the_slide_counts_as_far_as_the_tip_is_at_the_side_of_the_cup(shelf: SlideCupObstacles) -> None:
    shelf.reset(seed=0, options={"beyond_success": True})
    rows = []
    for action in shelf.leader(0):
        terms = shelf.step(action)[4]["reward_terms"]
        way = float(np.linalg.norm(shelf.ways[MARK]))
        rows.append((np.linalg.norm(shelf.ways["beside"]), 1.0 - way / FAR, *terms.values()))
    away, near, reach, slide, success = np.array(rows).T
    weights = shelf.reward.weights
    on_the_way = success == 0
    assert np.all((reach == weights["reach"])[on_the_way] == (away < 0.025)[on_the_way])
    share = (reach / weights["reach"])[on_the_way]
    assert share[0] < 0.6 and share[-1] == 1.0
    assert (slide / weights["slide"])[on_the_way] == pytest.approx(share * near[on_the_way])
    assert np.all(reach + slide + success == 1.0, where=~on_the_way)


def test_with_a_fixed_elbow_the_bottles_stop_the_arm(shelf: SlideCupObstacles) -> None:
    path = with_the_elbow_of_the_start(shelf)
    assert play(shelf, path) == ""
    forearm = {shelf.model.body(name).id for name in ("panda_link4", "panda_link5", "panda_link6")}
    bottles = {shelf.model.body(name).id for name in shelf.bottles}
    pairs = shelf.model.geom_bodyid[shelf.data.contact.geom].reshape(-1, 2)
    assert any({one, other} & forearm and {one, other} & bottles for one, other in pairs.tolist())


def test_with_a_fixed_elbow_the_arm_sweeps_a_plant(coffee: ServeCoffeeObstacles) -> None:
    assert play(coffee, with_the_elbow_of_the_start(coffee)) == "collision"


def test_any_touch_of_a_bottle_ends_the_service(coffee: ServeCoffeeObstacles) -> None:
    x, y = BOTTLES["bottle0"]
    for gap, outcome in ((0.005, ""), (-0.001, "collision")):
        coffee.reset(seed=0, options={"state": {MUG: (x, y - 0.030 - 0.032 - gap, 0.0)}})
        assert coffee._fails() == outcome  # before the bottle has pushed it away


def test_coffee_is_served_upright_on_the_plate_and_nowhere_else(coffee: ServeCoffeeObstacles) -> None:
    for offset, quaternion, outcome in (
        ((0.0, 0.0, 0.0), STRAIGHT, "success"),
        ((0.0, 0.12, -0.01), STRAIGHT, ""),  # beside it
        ((0.0, 0.0, 0.15), STRAIGHT, ""),  # above it, at first
        ((0.0, 0.0, 0.02), LEANING, ""),
    ):
        coffee.reset(seed=0)
        put(coffee, MUG, coffee.point("plate", (0.0, 0.0, coffee.plate.height)) + np.array(offset), quaternion)
        assert play(coffee, [still(coffee)] * (5 if outcome else 3)) == outcome


def test_a_mug_let_go_on_the_way_falls_and_its_stages_are_lost(coffee: ServeCoffeeObstacles) -> None:
    _, info = coffee.reset(seed=0)
    actions = coffee.leader(0)
    while coffee.position(MUG)[2] < TOP + 0.15:
        info = coffee.step(next(actions))[4]
    terms = info["reward_terms"]
    assert coffee.held == MUG and terms["reach"] == terms["upright"] == 0.0625
    assert 0 < terms["waypoint"] < 0.25 and terms["serve"] == 0.0
    for _ in range(10):
        terms = coffee.step(still(coffee, 1.0))[4]["reward_terms"]
    assert not coffee.grasped and coffee.position(MUG)[2] < TOP + 0.05
    assert 0 < terms["reach"] < 0.0625 and terms["upright"] == terms["waypoint"] == terms["serve"] == 0.0
